"""The demonstration: simulated rain, three networks, and a comparison with other methods."""

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from derain.datamodules.labelled import card_of, labelled_scans, rain_rates
from derain.datamodules.scan_data import Loading, ScanData
from derain.default import DEFAULT
from derain.errors import printable
from derain.example import EXAMPLE, Truth
from derain.export.bench.bench import Bench, bench
from derain.export.bench.cost import Effort
from derain.export.bench.report import SHORT, main_table
from derain.export.methods import load_method, load_method_of_one_scan
from derain.files import DEFAULT_COLUMNS
from derain.files.atomic import require_writable
from derain.files.labels import LABEL
from derain.jobs.workers import processes
from derain.pictures.scan_pictures import before_after_figure, save
from derain.simulation.campaign import Campaign, partition
from derain.simulation.dataset import simulate_track
from derain.sources.cleaned_scan import ScanOutcome
from derain.sources.cleaning import CleanReport, clean
from derain.sources.folders import named_frames
from derain.sources.frame import Frame
from derain.system.cores import usable_cores
from derain.system.notices import Notices, warn
from derain.workflows.fit import fit
from derain.workflows.learn import export_checkpoint
from derain.workflows.progress import Show, Steps, show_nothing
from derain.workflows.tuning import tune_filter_on, write_parameters

# Titles of the networks, and the beginning of their configurations' names.
DEMO_NETWORKS = {"3D-OutDet": "outdet", "SalsaNext": "salsanext", "LiSnowNet-L1": "lisnownet"}

# Methods that the networks are compared with: the model that comes with derain, a filter, and the
# baselines that every method has to beat.
OTHERS = (DEFAULT, "dror", "position", "intensity", "all", "none")

# 16 streets to train on, 5 to choose by, 5 to test on.
STREETS = Campaign(*partition(26), sensor="mems_64")

# Trials of the filter's tuning.
TRIALS = 100


@dataclass(frozen=True)
class DemoConfig:
    """Options of the demonstration. Options other than the defaults make it shorter.

    Attributes:
        out: Folder that everything is written to.
        streets: The campaign to simulate.
        networks: Networks that are trained, titles of ``DEMO_NETWORKS``.
        others: Methods that they are compared with.
        settings: Settings of every training, as :func:`derain.workflows.fit.fit` takes them.
        effort: Amount of timing in the comparison.
        scan: A scan of your own, or a folder of them; None for the example that comes with derain.
        columns: Names of the columns of its file, where that does not name them.
        workers: Processes of the simulation.
    """

    out: Path
    streets: Campaign = STREETS
    networks: Sequence[str] = tuple(DEMO_NETWORKS)
    others: Sequence[str] = OTHERS
    settings: Mapping[str, Any] = field(default_factory=dict)
    effort: Effort = field(default_factory=Effort)
    scan: Path | None = None
    columns: Sequence[str] = DEFAULT_COLUMNS
    workers: int = field(default_factory=usable_cores)

    @property
    def given(self) -> Path:
        """Folder of what is cleaned first: your own scans are not written among the example's."""
        return self.out / (EXAMPLE if self.scan is None else "yours")

    @property
    def data(self) -> Path:
        """Folder of the simulated scans."""
        return self.out / "simulated"

    @property
    def tuned(self) -> Path:
        """File of the filter's tuned parameters."""
        return self.out / "dsor.yaml"

    def model(self, title: str) -> Path:
        """The ONNX file of a network."""
        return self.out / f"{DEMO_NETWORKS[title]}.onnx"


def run_demo(config: DemoConfig, show: Show = show_nothing) -> Bench:
    """Cleans what is given, and then simulates, tunes, trains, exports, cleans and compares.

    Args:
        config: Options of the demonstration.
        show: Receives a line for each step, and lines for its result.

    Returns:
        The comparison.

    Raises:
        InputError: The error of a step.
    """
    # Cleaning, simulation, tuning and comparison; cleaning once more by the first network.
    steps = Steps(show, 4 + 2 * len(config.networks) + bool(config.networks))
    clean_given_scans(config.scan or Path(EXAMPLE), config.columns, config.given, steps)
    steps.begin(f"Simulation: rain in {len(config.streets.names)} streets")
    with processes(config.workers) as executor:
        simulate_track(config.data, config.streets, executor)
    steps.end(f"{len(config.streets.names) * config.streets.scans} scans in {config.data}")
    data = labelled_scans([config.data], card_of([config.data], None), Loading())
    _tune(config, data, steps)
    frame = _rainiest(config, data)
    for title in config.networks:
        _train(config, title, steps)
        if title == config.networks[0]:
            _clean(config, title, frame, steps)
    found = _compare(config, data, steps)
    show(f"\n{main_table(found.rows, SHORT)}\n")
    show("Simulated rain on streets like those of the training is easy: real rain is not.")
    show(f"Done in {steps.elapsed}")
    return found


def _tune(config: DemoConfig, data: ScanData, steps: Steps) -> None:
    steps.begin(f"Tuning: {TRIALS} trials of the filter dsor")
    frames = data.frames("validation")
    tuned = tune_filter_on("dsor", data, frames, TRIALS)
    command = _command("tune", "dsor", "--data", config.data, "--out", config.tuned)
    write_parameters(config.tuned, "dsor", tuned.parameters, command)
    steps.end(f"IoU {tuned.iou:.4f} on {len(frames)} scans, {tuned.default_iou:.4f} by default")


def _rainiest(config: DemoConfig, data: ScanData) -> Frame:
    """The last scan of the test sequence with the highest rain rate."""
    rates = rain_rates([config.data], None)
    return max(data.frames("test"), key=lambda frame: (rates[frame.sequence], frame.key))


def _train(config: DemoConfig, title: str, steps: Steps) -> None:
    """Trains a network and exports it."""
    name, model = DEMO_NETWORKS[title], config.model(title)
    checkpoint = config.out / f"{name}.ckpt"
    checkpoint.unlink(missing_ok=True)
    steps.begin(f"Training: {title}")
    settings = {
        "data.root": config.data,
        "data.make": False,
        "trainer.logger.save_dir": config.out / "runs",
        "checkpoint.dirpath": config.out,
        "checkpoint.filename": name,
        **config.settings,
    }
    trained = fit(f"{name}_simulated.yaml", settings, quiet=True)
    steps.end("trained" if trained.iou is None else f"IoU {trained.iou:.3f} on streets held out")
    export_checkpoint(checkpoint, model, steps)


def _clean(config: DemoConfig, title: str, frame: Frame, steps: Steps) -> None:
    """Cleans the sequence of a scan, and draws the scan before and after."""
    folder, model = Path(frame.name).parent, config.model(title)
    steps.begin(f"Cleaning: {folder}, by {model}")
    method, out = load_method(str(model), {}), config.out / "cleaned"
    report = clean(named_frames([folder]), method, out, watch=Watch(out).take)
    picture, heading = config.out / "before_after.png", f"Simulated rain, cleaned by {title}"
    _draw_before_and_after(frame, str(model), heading, picture)
    steps.end(f"{report}; before and after: {picture}")


def _draw_before_and_after(frame: Frame, method: str, heading: str, picture: Path) -> None:
    """Draws a scan, whether it is cleaned or left whole."""
    scan = frame.read()
    rain = load_method_of_one_scan(method, {}).judge(scan).rain
    save(before_after_figure(scan, rain, heading), picture)


def _compare(config: DemoConfig, data: ScanData, steps: Steps) -> Bench:
    steps.begin("Comparison: error, time and memory of every method on the same scans")
    networks = [f"{title}={config.model(title)}" for title in config.networks]
    names = [*networks, f"dsor, tuned={config.tuned}", *config.others]
    out = config.out / "bench"
    require_writable(out / "bench.json")
    found = bench(
        names,
        data.frames("test"),
        data.card,
        train=data.frames("train"),
        rain_rates=rain_rates([config.data], None),
        **asdict(config.effort),
    )
    command = _command("bench", "--data", config.data, "--out", out, "--methods", *names)
    found = replace(found, facts={**found.facts, "command": command})
    found.write(out)
    steps.end(str(out / "bench.md"))
    return found


def _command(*words: str | Path) -> str:
    """A command of derain that repeats a step, as a shell takes it."""
    return printable(shlex.join(["derain", *map(str, words)]))


class Watch:
    """Prints warnings about scans, and counts the removed rain of the example.

    Args:
        labels: Folder of the labels that the scans get.

    Attributes:
        truth: Counts of the example's rain.
    """

    def __init__(self, labels: Path) -> None:
        self.truth = Truth()
        self._labels = labels
        self._notices = Notices()

    def take(self, outcome: ScanOutcome) -> None:
        """Prints the warnings or the error of a scan, and compares its labels with the truth."""
        self._notices.warn(outcome.frame.name, outcome.issues)
        if outcome.error is not None:
            warn(str(outcome.error))
            return
        self.truth.add(outcome.frame.name, self._labels / f"{outcome.frame.key}{LABEL}")


def clean_given_scans(scans: Path, columns: Sequence[str], out: Path, steps: Steps) -> CleanReport:
    """Cleans scans by the model that comes with derain, with a picture of the first.

    Args:
        scans: A scan, or a folder of them, or the example.
        columns: Names of the columns of files that do not name them.
        out: Folder of the clean scans and the picture.
        steps: Shows the step.

    Raises:
        InputError: A folder without scans, or an output that cannot be written.
    """
    steps.begin(f"Cleaning: {scans}, by the model that comes with derain")
    source, watch = named_frames([scans], columns), Watch(out)
    report = clean(source, load_method(DEFAULT, {}), out, watch=watch.take)
    heading = f"{source[0].key}, cleaned by the model that comes with derain"
    picture = out / "before_after.png"
    _draw_before_and_after(source[0], DEFAULT, heading, picture)
    steps.end(f"{report}; before and after: {picture}")
    if watch.truth.rain:
        steps.show(f"        {watch.truth}")
    return report
