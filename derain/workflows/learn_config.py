"""Options of learning: the recording, the teacher and the network."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import yaml

from derain.default import DEFAULT
from derain.errors import InputError
from derain.export.methods import CUES
from derain.files import DEFAULT_COLUMNS
from derain.learning.start import checkpoint_of
from derain.scan import Scan
from derain.sources.judging import Failures
from derain.sources.source import Source
from derain.spec import Spec
from derain.workflows.configurations import packaged_configs

# Networks that learn from labels, and the beginning of their configurations' names.
STUDENTS = ("outdet", "salsanext", "salsanext_lite", "cues")

# Channels of a network that is blind to intensity, as the option `--model.channels` takes them.
BLIND = {"outdet": "[x,y,z]", "salsanext": "[range,x,y,z]", "salsanext_lite": "[range,x,y,z]"}


@dataclass(frozen=True)
class LearnConfig:
    """Options of :func:`derain.workflows.learn.learn`.

    Example:
        >>> config = LearnConfig([Path("drive")], Path("model.onnx"), epochs=5)
        >>> str(config.work), config.teacher
        ('model_learning', 'default')

    Attributes:
        recordings: Folders of consecutive scans, or bags; one or several, as paths or texts.
        out: The ONNX file.
        folder: Folder of everything else; None for ``<out>_learning`` beside the model. A second
            run clears it.
        model: Name of the network; None for that of the start, and for 3D-OutDet without one.
        teacher: Name of the teacher, or the file of a model.
        poses: Poses of the scans, as the option ``--poses`` takes them; None for those beside the
            scans. A teacher that needs poses finds them where there are none.
        blind: True if the network learns without intensity.
        columns: Names of the columns of files that do not name them.
        epochs: Epochs of the training; None for those of the network's configuration.
        start: The trained model whose weights the network begins with. None draws them at random
            where a network is named, or one without intensity is wanted, and else begins with
            the model that comes with derain.
        topic: Topic of the bags; None where each has only one of clouds.

    Raises:
        InputError: No recording, or no epoch.
    """

    recordings: Sequence[Path]
    out: Path
    folder: Path | None = None
    model: str | None = None
    teacher: str = DEFAULT
    poses: str | None = None
    blind: bool = False
    columns: Sequence[str] = DEFAULT_COLUMNS
    epochs: int | None = None
    start: str | None = None
    topic: str | None = None

    def __post_init__(self) -> None:
        given = self.recordings
        # One path is no sequence of letters, and an iterator would be at its end the second time.
        recordings = (given,) if isinstance(given, str | Path) else tuple(given)
        if not recordings:
            raise InputError("recordings", "there are none", "Give one or more.")
        object.__setattr__(self, "recordings", recordings)
        object.__setattr__(self, "out", Path(self.out))
        if self.folder is not None:
            object.__setattr__(self, "folder", Path(self.folder))
        if self.epochs is not None and self.epochs < 1:
            raise InputError("epochs", f"{self.epochs} is too few", "Give 1 or more.")

    @property
    def begins_with(self) -> str | None:
        """The trained model whose weights the network begins with; None draws them at random."""
        chosen = self.start is not None or self.model is not None or self.blind
        return self.start if chosen else DEFAULT

    @property
    def work(self) -> Path:
        """Folder of everything but the model."""
        return self.folder or self.out.with_name(f"{self.out.stem}_learning")

    @property
    def taught(self) -> Path:
        """Folder of the teacher's labels."""
        return self.work / "taught"

    @property
    def checkpoint(self) -> Path:
        """Checkpoint of the student, the best by its agreement with the teacher."""
        return self.work / "student.ckpt"


@dataclass(frozen=True)
class Student:
    """The network that learns; as text, its title in a report.

    Attributes:
        network: Its name.
        blind: True if it sees no intensity.
        start: The trained model that it begins with; None where its weights are drawn at random.
        config: The packaged configuration of its training.
        settings: Settings of the network over that configuration, as
            :func:`derain.workflows.fit.fit` takes them.
        epochs: Epochs of the training.
    """

    network: str
    blind: bool
    start: str | None
    config: str
    settings: Mapping[str, str]
    epochs: int

    @property
    def sees_unit(self) -> bool:
        """True if it sees intensity in the unit of its scans; cues do as each scan shows it."""
        return not self.blind and self.network != CUES

    def __str__(self) -> str:
        blind = ", blind to intensity" if self.blind else ""
        start = "" if self.start is None else f", started from {self.start}"
        return f"{self.network}{blind}{start}"


def student_of(config: LearnConfig, source: Source) -> Student:
    """The network that learns from a recording: one with a start sees what that sees.

    Args:
        config: Options of the run.
        source: The scans; without intensities, the student is blind to them.

    Raises:
        InputError: Scans none of which can be read; a start that cannot be read, that lies in the
            folder to be cleared, that is of another network, or that sees intensity where the
            student is to be blind or the scans have none.
    """
    sees_intensity = _first_readable(source).intensity is not None and not config.blind
    start = config.begins_with
    if start is None:
        network = config.model or STUDENTS[0]
        blind = not sees_intensity and network != CUES
        if network == CUES:
            _refuse_blind(config.blind, f"{CUES} uses intensity")
    else:
        spec = _spec_of_start(config, start)
        network, blind = spec.network, not spec.weighs_intensity
        if "intensity" in spec.channels and not sees_intensity:
            raise InputError(
                config.recordings[0],
                f"has no intensities, which {start} needs",
                "Give --start a model without intensity, or name a network by --model.",
            )
    file, settings = _configuration(network)
    if start is not None:
        settings["start"] = start
    elif blind:
        settings["model.channels"] = BLIND[network]
    usual = yaml.safe_load(packaged_configs()[file].read_text("utf-8"))["trainer"]["max_epochs"]
    return Student(network, blind, start, file, settings, config.epochs or int(usual))


def _first_readable(source: Source) -> Scan:
    """The first scan that can be read; raises the error of the first if none can."""
    failures = Failures()
    for frame in source:
        with failures.skipping_failures(frame):
            return frame.read()
    raise failures.errors[0]


def _spec_of_start(config: LearnConfig, start: str) -> Spec:
    """The Spec of the model to start from."""
    from derain.models.checkpoint import load_model

    checkpoint = checkpoint_of(start)
    if config.work.resolve() in checkpoint.resolve().parents:
        raise InputError(
            start,
            f"lies in {config.work}, which this run clears first",
            "Give another --work, or copy it elsewhere.",
        )
    spec = load_model(checkpoint).spec
    if config.model not in (None, spec.network):
        raise InputError(
            "--model",
            f"{start} is of {spec.network}, from which {config.model} cannot start",
            f"Leave --model out, or give a start of {config.model}.",
        )
    if spec.weighs_intensity:
        reason = f"{start} sees intensity, and so does a student that starts from it"
        _refuse_blind(config.blind, reason)
    return spec


def _refuse_blind(blind: bool, reason: str) -> None:
    if blind:
        remedy = "Leave it out, or give another --model or --start."
        raise InputError("--blind", reason, remedy)


def _configuration(network: str) -> tuple[str, dict[str, str]]:
    """The packaged configuration of a network; without one, that of a network of the same view."""
    from derain.models.registry import NETWORKS
    from derain.views.neighbours import NeighbourView

    own = f"{network}_taught.yaml"
    if own in packaged_configs():
        return own, {}
    kind = NETWORKS[network]
    alike = "outdet" if issubclass(kind.VIEW, NeighbourView) else "salsanext"
    return f"{alike}_taught.yaml", {"model": f"{kind.__module__}.{kind.__qualname__}"}
