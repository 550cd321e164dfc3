"""Functions of a scan as methods of a bench."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from derain.errors import InputError
from derain.scan import Scan
from derain.system.stopwatch import Stopwatch


@dataclass(frozen=True)
class TimedFunction:
    """A function without a view or a network of its own, timed as one stage.

    Attributes:
        function: Says which points of a scan are rain, bool (N,).
    """

    function: Callable[[Scan], NDArray[Any]]

    def ready(self, threads: int) -> "TimedFunction":
        """The method itself; how many threads a function uses is not for a bench to say."""
        return self

    def __call__(self, scan: Scan, stopwatch: Stopwatch) -> NDArray[np.bool_]:
        """Which points are rain, bool (N,).

        Raises:
            InputError: The function gives anything but one truth for each point.
        """
        with stopwatch.stage("network"):
            rain = np.asarray(self.function(scan))
        if rain.shape != (len(scan),) or rain.dtype != bool:
            raise InputError(
                scan.name,
                f"the method gives {rain.dtype} of shape {rain.shape} for {len(scan):,} points",
                "Let it return a bool array of shape (N,), True for rain.",
            )
        return rain
