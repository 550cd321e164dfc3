"""Radius outlier removal."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from derain.filters.radius_filter import RadiusFilter


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

    neighbours: int = 4
    radius: float = 0.08

    def radius_at(self, points: NDArray[np.float32]) -> NDArray[np.float64]:
        """The radius around each point; see :class:`RadiusFilter`."""
        return np.full(len(points), self.radius, np.float64)
