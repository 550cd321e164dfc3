"""Dynamic statistical outlier removal."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from derain.filters.point_filter import TUNED_NEIGHBOURS, PointFilter, Span
from derain.filters.registry import FILTERS
from derain.filters.usual_distance import mean_distance, usual_limit
from derain.views.neighbours import Neighbourhoods


@FILTERS.add("dsor")
@dataclass(frozen=True)
class DSOR(PointFilter):
    """Calls a point rain if it lies farther from its neighbours than is usual at its range.

    With m the mean distance of a point to the others of its neighbourhood: rain where
    m ≥ (mean(m) + ``deviation_multiplier`` · std(m)) · ``range_multiplier`` · range, over all
    points of the scan, the standard deviation being that of n - 1 and the range that in space.
    What is very near the sensor is rain by this definition. A scan of a single point says nothing
    of what is usual: not rain.

    Example:
        >>> scan = derain.read_scan("scan.bin")  # a wall of 800 points and 20 drops before it
        >>> rain = derain.FilterDerainer(DSOR())(scan)
        >>> int(rain.sum()), bool((scan.range[rain] < 15).all())
        (20, True)

    Attributes:
        neighbours: Size of a neighbourhood, the point itself included.
        deviation_multiplier: s, standard deviations above the mean that are still usual.
        range_multiplier: r, by which the limit grows with range, per metre.

    Source: A. Kurup and J. Bos, "DSOR: A Scalable Statistical Filter for Removing Falling Snow from
        LiDAR Point Clouds in Severe Winter Weather", arXiv 2109.07078, 2021, and its defaults.
    """

    HELP: ClassVar[str] = "rain lies farther from its neighbours than is usual at its range"
    SPACE: ClassVar[Mapping[str, Span]] = {
        "neighbours": TUNED_NEIGHBOURS,
        "deviation_multiplier": (0.001, 10.0),
        "range_multiplier": (0.002, 2.0),
    }

    neighbours: int = 5
    deviation_multiplier: float = 0.01
    range_multiplier: float = 0.05

    def judge(self, view: Neighbourhoods) -> NDArray[np.bool_]:
        """Says which points are rain; see :class:`PointFilter`."""
        if view.size < 2:
            return np.zeros(view.size, bool)
        distance = mean_distance(view, self.neighbours)
        x, y, z = view.points[:, :3].T.astype(np.float64)
        reach = self.range_multiplier * np.sqrt(x * x + y * y + z * z)
        rain: NDArray[np.bool_] = (
            distance >= usual_limit(distance, self.deviation_multiplier) * reach
        )
        return rain
