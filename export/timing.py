"""Timed runs of a method, from file to mask, stage by stage, and the machine that they ran on."""

import platform
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np

import derain
from derain.evaluation.hard_cases import scene
from derain.export.runtime import Derainer
from derain.export.runtimes.session import DEFAULT_RUNTIME, RUNTIMES, Runtime
from derain.files import DEFAULT_COLUMNS
from derain.scan import Floats, Scan
from derain.sources.folders import frame_of
from derain.sources.frame import Frame
from derain.system.stopwatch import Stopwatch

STAGES = ("read", "view", "network", "back")

PERCENTILES = (50, 90, 99)

# Runs before any is timed: the first ones fill caches, and have libraries allocate their memory.
WARM_UP = 3


@dataclass(frozen=True, eq=False)
class RunTimes:
    """Milliseconds of the timed runs of one method.

    Attributes:
        stages: Those of each run by stage, float64 (runs,); 0 in stages that the method has not.
    """

    stages: Mapping[str, Floats]

    @classmethod
    def of_no_runs(cls) -> "RunTimes":
        """Those of a method that could not be run."""
        return cls({stage: np.zeros(0) for stage in STAGES})

    @property
    def total(self) -> Floats:
        """Milliseconds of each run in all its stages, float64 (runs,)."""
        return np.sum(list(self.stages.values()), axis=0)  # type: ignore[no-any-return]

    def percentile(self, percentage: float, stage: str | None = None) -> float:
        """Milliseconds that this share of the runs stay within.

        Args:
            percentage: The share, 0 to 100.
            stage: One of the stages; None for all of them together.

        Returns:
            Milliseconds; not a number where nothing was run.
        """
        times = self.total if stage is None else self.stages[stage]
        return float(np.percentile(times, percentage)) if len(times) else float("nan")


def timed_runs(
    method: Callable[[Scan, Stopwatch], object],
    frames: Sequence[Frame],
    repeats: int,
) -> RunTimes:
    """Reads and judges every scan, in turns, again and again.

    ``WARM_UP`` runs on the first scan come before those that are timed.

    Args:
        method: Judges a scan, and gives the stopwatch its stages.
        frames: The scans, one or more.
        repeats: Timed runs on each scan.

    Raises:
        InputError: A scan that cannot be read.
    """

    def timed(frame: Frame) -> dict[str, float]:
        stopwatch = Stopwatch()
        with stopwatch.stage("read"):
            scan = frame.read()
        method(scan, stopwatch)
        return stopwatch.milliseconds

    for _ in range(WARM_UP):
        timed(frames[0])
    runs = [timed(frame) for _ in range(repeats) for frame in frames]
    return RunTimes({stage: np.array([run.get(stage, 0.0) for run in runs]) for stage in STAGES})


def measure_latency(
    model: Path,
    scan: Path | None = None,
    columns: Sequence[str] = DEFAULT_COLUMNS,
    threads: int = 0,
    repeats: int = 30,
    runtime: Runtime = Runtime(),
) -> str:
    """Times an exported model from file to mask; a table of percentiles by stage, in milliseconds.

    Args:
        model: ONNX file.
        scan: Scan to time it on; None takes a made-up one of 100,000 points.
        columns: Names of the columns of a scan that does not name them.
        threads: Threads; 0 takes every core this process may use.
        repeats: Timed runs.
        runtime: Runtime of the network.

    Raises:
        InputError: A model or scan that cannot be read.
    """
    with tempfile.TemporaryDirectory() as folder:
        if scan is None:
            scan, columns = Path(folder) / "scene.bin", DEFAULT_COLUMNS
            scene(100_000).tofile(scan)
        derainer = Derainer(model, threads, runtime.name, runtime.precision)
        frame = frame_of(scan, columns)
        times = timed_runs(derainer.probability, [frame], repeats)
        points = f"{frame.count_points():,} points, {derainer.threads} threads"
    head = f"{points}, {repeats} runs, milliseconds"
    return "\n".join([head, percentile_table(times), versions([runtime.name])])


def percentile_table(times: RunTimes) -> str:
    """Percentiles of the times of each stage and of them all, a line each."""
    lines = ["stage   " + "".join(f"{f'p{percentage}':>9}" for percentage in PERCENTILES)]
    for name, stage in (*((stage, stage) for stage in times.stages), ("total", None)):
        values = (times.percentile(percentage, stage) for percentage in PERCENTILES)
        lines.append(f"{name:8}" + "".join(f"{value:9.1f}" for value in values))
    return "\n".join(lines)


def versions(runtimes: Iterable[str] = (DEFAULT_RUNTIME,)) -> str:
    """The processor, and the versions that a time depends on.

    Args:
        runtimes: Names of what ran networks.
    """
    packages = dict.fromkeys(RUNTIMES[name].PACKAGE for name in runtimes)
    ran = "".join(f"{_with_version(package)}, " for package in packages)
    return (
        f"{processor()}; derain {derain.__version__}, {ran}"
        f"NumPy {np.__version__}, Python {platform.python_version()}"
    )


def _with_version(package: str) -> str:
    """A package with its version, as far as it is installed under that name."""
    try:
        return f"{package} {version(package)}"
    except PackageNotFoundError:  # another brings the same modules, as onnxruntime-gpu does
        return package


def processor() -> str:
    """Name of the processor, as far as it is known."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()
