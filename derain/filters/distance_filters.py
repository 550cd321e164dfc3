"""SOR and DSOR, by which a point is rain if it lies farther from its neighbours than is usual."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from derain.filters.point_filter import FILTERS, TUNED_NEIGHBOURS, PointFilter
from derain.scan import Bools, Floats
from derain.views.neighbours import Neighbourhoods


@FILTERS.add("sor")
@dataclass(frozen=True)
class SOR(PointFilter):
    """Calls a point rain if it lies farther from its neighbours than is usual in the scan.

    With m the mean distance of a point to the others of its neighbourhood: rain where
    m > mean(m) + ``deviation_multiplier`` · std(m), over all points of the scan, the standard
    deviation being that of n - 1. In a scan of a single point nothing is usual: not rain.

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

    HELP = "rain lies farther from its neighbours than is usual in the scan"
    SPACE: ClassVar = {"neighbours": TUNED_NEIGHBOURS, "deviation_multiplier": (0.001, 10.0)}

    neighbours: int = 5
    deviation_multiplier: float = 0.01

    def judge(self, view: Neighbourhoods) -> Bools:
        """Returns which points are rain; see :class:`PointFilter`."""
        if view.size < 2:
            return np.zeros(view.size, bool)
        distance = mean_distance(view, self.neighbours)
        return distance > usual_limit(distance, self.deviation_multiplier)


@FILTERS.add("dsor")
@dataclass(frozen=True)
class DSOR(PointFilter):
    """Calls a point rain if it lies farther from its neighbours than is usual at its range.

    With m the mean distance of a point to the others of its neighbourhood: rain where
    m ≥ (mean(m) + ``deviation_multiplier`` · std(m)) · ``range_multiplier`` · range, over all
    points of the scan, the standard deviation being that of n - 1 and the range that in space.
    What is very near the sensor is rain by this definition. In a scan of a single point nothing is
    usual: not rain.

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

    HELP = "rain lies farther from its neighbours than is usual at its range"
    SPACE: ClassVar = {
        "neighbours": TUNED_NEIGHBOURS,
        "deviation_multiplier": (0.001, 10.0),
        "range_multiplier": (0.002, 2.0),
    }

    neighbours: int = 5
    deviation_multiplier: float = 0.01
    range_multiplier: float = 0.05

    def judge(self, view: Neighbourhoods) -> Bools:
        """Returns which points are rain; see :class:`PointFilter`."""
        if view.size < 2:
            return np.zeros(view.size, bool)
        distance = mean_distance(view, self.neighbours)
        x, y, z = view.points[:, :3].T.astype(np.float64)
        reach = self.range_multiplier * np.sqrt(x * x + y * y + z * z)
        return np.asarray(distance >= usual_limit(distance, self.deviation_multiplier) * reach)


def mean_distance(view: Neighbourhoods, neighbours: int) -> Floats:
    """Mean distance of every point to the others of its neighbourhood.

    Args:
        view: One scan of two points or more, with at least ``neighbours`` neighbours a point.
        neighbours: Size of a neighbourhood, the point itself included; those that the scan does
            not have are left out of the mean.

    Returns:
        Metres, float64 (M,).
    """
    others = min(neighbours, view.size) - 1
    # Column by column, which is several times faster than along the short axis.
    total = np.zeros(view.size)
    for column in view.distances[:, 1 : others + 1].T:
        total += column
    return total / others


def usual_limit(distance: Floats, deviations: float) -> float:
    """Mean of two distances or more, plus a number of their standard deviations (of n - 1)."""
    return float(distance.mean() + deviations * distance.std(ddof=1))
