"""Timed runs of a method, from file to mask, stage by stage."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from derain.scan import Scan
from derain.sources.frame import Frame
from derain.system.stopwatch import Stopwatch

STAGES = ("read", "view", "network", "back")

# Runs before any is timed: the first ones fill caches, and have libraries allocate their memory.
WARM_UP = 3


@dataclass(frozen=True, eq=False)
class RunTimes:
    """Milliseconds of the timed runs of one method.

    Attributes:
        stages: Those of each run by stage, float64 (runs,); 0 in stages that the method has not.
    """

    stages: Mapping[str, NDArray[np.float64]]

    @classmethod
    def of_no_runs(cls) -> "RunTimes":
        """Those of a method that could not be run."""
        return cls({stage: np.zeros(0) for stage in STAGES})

    @property
    def total(self) -> NDArray[np.float64]:
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
