"""Radius outlier removal."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from derain.filters.point_filter import TUNED_NEIGHBOURS, Span
from derain.filters.radius_filter import RadiusFilter
from derain.filters.registry import FILTERS


@FILTERS.add("ror")
@dataclass(frozen=True)
class ROR(RadiusFilter):
    """Calls a point rain if it has few points around it.

    Rain where fewer than ``neighbours`` points, itself included, lie within ``radius``. PCL's
    RadiusOutlierRemoval and Open3D's remove_radius_outlier decide alike, but count the point
    itself on neither side: their number is one less than ``neighbours``.

    Example:
        >>> scan = derain.read_scan("scan.bin")  # a wall of 800 points and 20 drops before it
        >>> rain = derain.FilterDerainer(ROR())(scan)
        >>> int(rain.sum()), bool((scan.range[rain] < 15).all())
        (20, True)

    Attributes:
        neighbours: Points to be found, the point itself included.
        radius: Radius of the sphere, metres; a point on it is within.

    Source: R. B. Rusu and S. Cousins, "3D is here: Point Cloud Library", ICRA 2011. The defaults
        are those of github.com/nickcharron/lidar_snow_removal (3 others, 0.08 m).
    """

    HELP: ClassVar[str] = "rain has few points within a radius"
    SPACE: ClassVar[Mapping[str, Span]] = {
        "neighbours": TUNED_NEIGHBOURS,
        "radius": (0.01, 3.0),
    }

    neighbours: int = 4
    radius: float = 0.08

    def radius_at(self, points: NDArray[np.float32]) -> NDArray[np.float64]:
        """The radius around each point; see :class:`RadiusFilter`."""
        return np.full(len(points), self.radius, np.float64)
