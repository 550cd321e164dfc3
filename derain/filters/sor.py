"""Statistical outlier removal."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from derain.filters.point_filter import TUNED_NEIGHBOURS, PointFilter, Span
from derain.filters.registry import FILTERS
from derain.filters.usual_distance import mean_distance, usual_limit
from derain.views.neighbours import Neighbourhoods


@FILTERS.add("sor")
@dataclass(frozen=True)
class SOR(PointFilter):
    """Calls a point rain if it lies farther from its neighbours than is usual in the scan.

    With m the mean distance of a point to the others of its neighbourhood: rain where
    m > mean(m) + ``deviation_multiplier`` · std(m), over all points of the scan, the standard
    deviation being that of n - 1. A scan of a single point says nothing of what is usual: not rain.

    PCL's StatisticalOutlierRemoval decides so with a mean_k of ``neighbours`` - 1. Open3D's
    remove_statistical_outlier with an nb_neighbors of ``neighbours`` takes the point itself into
    its means; that scales both sides alike and so decides the same, save that a point just at the
    limit goes.

    Example:
        >>> scan = derain.read_scan("scan.bin")  # a wall of 800 points and 20 drops before it
        >>> rain = derain.FilterDerainer(SOR())(scan)
        >>> int(rain.sum()), bool((scan.range[rain] < 15).all())
        (20, True)

    Attributes:
        neighbours: Size of a neighbourhood, the point itself included.
        deviation_multiplier: Standard deviations above the mean that are still usual.

    Source: R. B. Rusu et al., "Towards 3D Point cloud based object maps for household
        environments", Robotics and Autonomous Systems 56, 2008. The defaults are those of DSOR,
        which extends it.
    """

    HELP: ClassVar[str] = "rain lies farther from its neighbours than is usual in the scan"
    SPACE: ClassVar[Mapping[str, Span]] = {
        "neighbours": TUNED_NEIGHBOURS,
        "deviation_multiplier": (0.001, 10.0),
    }

    neighbours: int = 5
    deviation_multiplier: float = 0.01

    def judge(self, view: Neighbourhoods) -> NDArray[np.bool_]:
        """Says which points are rain; see :class:`PointFilter`."""
        if view.size < 2:
            return np.zeros(view.size, bool)
        distance = mean_distance(view, self.neighbours)
        return distance > usual_limit(distance, self.deviation_multiplier)
