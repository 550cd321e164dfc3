"""How long an exported model takes, stage by stage."""

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from derain.evaluation.hard_cases import scene
from derain.export.machine import versions
from derain.export.runtime import Derainer
from derain.export.runtimes.registry import Runtime
from derain.export.timing import RunTimes, timed_runs
from derain.files import DEFAULT_COLUMNS
from derain.sources.folders import frame_of

PERCENTILES = (50, 90, 99)


@dataclass(frozen=True)
class Latency:
    """Times of an exported model; as text, a table of their percentiles.

    Attributes:
        times: Milliseconds of every run.
        points: Points of the scan.
        threads: Threads of view and network.
        versions: The processor, and the software that ran.
    """

    times: RunTimes
    points: int
    threads: int
    versions: str

    def __str__(self) -> str:
        runs = len(self.times.total)
        lines = [
            f"{self.points:,} points, {self.threads} threads, {runs} runs, milliseconds",
            "stage   " + "".join(f"{f'p{percentage}':>9}" for percentage in PERCENTILES),
        ]
        for name, stage in (*((stage, stage) for stage in self.times.stages), ("total", None)):
            values = (self.times.percentile(percentage, stage) for percentage in PERCENTILES)
            lines.append(f"{name:8}" + "".join(f"{value:9.1f}" for value in values))
        return "\n".join([*lines, self.versions])


def measure_latency(
    model: Path,
    scan: Path | None = None,
    columns: Sequence[str] = DEFAULT_COLUMNS,
    threads: int = 0,
    repeats: int = 30,
    runtime: Runtime = Runtime(),
) -> Latency:
    """Times an exported model from file to mask.

    Args:
        model: ONNX file.
        scan: Scan to time it on; None takes a made-up one of 100,000 points.
        columns: Names of the columns of a scan that does not name them.
        threads: Threads; 0 takes every core this process may use.
        repeats: Timed runs.
        runtime: What runs the network.

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
        software = versions([runtime.name])
        return Latency(times, frame.count_points(), derainer.threads, software)
