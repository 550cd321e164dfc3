"""How long an exported model takes, stage by stage."""

import platform
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import onnxruntime
from numpy.typing import NDArray

import derain
from derain.evaluation.hard_cases import scene
from derain.export.runtime import Derainer
from derain.export.timing import timed_runs
from derain.files import DEFAULT_COLUMNS, read_scan

WARM_UP = 5
PERCENTILES = (50, 90, 99)


@dataclass(frozen=True)
class Latency:
    """Milliseconds of every run.

    Attributes:
        stages: Milliseconds of each run, by stage: read, view, network, back, and total, float64
            (runs,).
        points: Points of the scan.
        threads: Threads of view and network.
        versions: The processor, and the software that ran.
    """

    stages: dict[str, NDArray[np.float64]]
    points: int
    threads: int
    versions: str

    def __str__(self) -> str:
        repeats = len(self.stages["total"])
        lines = [
            f"{self.points:,} points, {self.threads} threads, {repeats} runs, milliseconds",
            "stage   " + "".join(f"{f'p{percentile}':>9}" for percentile in PERCENTILES),
        ]
        for stage, times in self.stages.items():
            values = np.percentile(times, PERCENTILES)
            lines.append(f"{stage:8}" + "".join(f"{value:9.1f}" for value in values))
        return "\n".join([*lines, self.versions])


def measure_latency(
    model: Path,
    scan: Path | None = None,
    columns: Sequence[str] = DEFAULT_COLUMNS,
    threads: int = 0,
    repeats: int = 30,
) -> Latency:
    """Times an exported model from file to mask.

    Args:
        model: ONNX file.
        scan: Scan to time it on; None takes a made-up one of 100,000 points.
        columns: Names of the columns of a scan that does not name them.
        threads: Threads; 0 takes every core this process may use.
        repeats: Timed runs.

    Raises:
        InputError: A model or scan that cannot be read.
    """
    with tempfile.TemporaryDirectory() as folder:
        if scan is None:
            scan, columns = Path(folder) / "scene.bin", DEFAULT_COLUMNS
            scene(100_000).tofile(scan)
        derainer = Derainer(model, threads)
        stages = timed_runs(derainer.probability, [scan], columns, WARM_UP, repeats)
        stages["total"] = np.sum(list(stages.values()), axis=0)
        return Latency(stages, len(read_scan(scan, columns)), derainer.threads, versions())


def versions() -> str:
    """The processor, and the versions that a time depends on."""
    return (
        f"{processor()}; derain {derain.__version__}, onnxruntime {onnxruntime.__version__}, "
        f"NumPy {np.__version__}, Python {platform.python_version()}"
    )


def processor() -> str:
    """Name of the processor, as far as the system tells."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()
