"""Timed runs of a method, from file to mask, stage by stage."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from derain.files import read_scan
from derain.scan import Scan
from derain.system.stopwatch import Stopwatch

STAGES = ("read", "view", "network", "back")


def timed_runs(
    method: Callable[[Scan, Stopwatch], object],
    scans: Sequence[Path],
    columns: Sequence[str],
    warm_up: int,
    repeats: int,
) -> dict[str, NDArray[np.float64]]:
    """Reads and judges every scan, in turns, again and again.

    Args:
        method: Judges a scan, and gives the stopwatch its stages.
        scans: Files of the scans, one or more.
        columns: Names of the columns of scans that do not name them.
        warm_up: Runs on the first scan before any is timed.
        repeats: Timed runs on each scan.

    Returns:
        Milliseconds of each run by stage, float64 (runs,); 0 in stages that the method has not.

    Raises:
        InputError: A scan that cannot be read.
    """

    def timed(path: Path) -> dict[str, float]:
        stopwatch = Stopwatch()
        with stopwatch.stage("read"):
            scan = read_scan(path, columns)
        method(scan, stopwatch)
        return stopwatch.milliseconds

    for _ in range(warm_up):
        timed(scans[0])
    runs = [timed(path) for _ in range(repeats) for path in scans]
    return {stage: np.array([run.get(stage, 0.0) for run in runs]) for stage in STAGES}
