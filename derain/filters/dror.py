"""Dynamic radius outlier removal."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from derain.errors import InputError
from derain.files.documents import shown
from derain.filters.point_filter import TUNED_NEIGHBOURS, Span
from derain.filters.radius_filter import RadiusFilter
from derain.filters.registry import FILTERS

Variant = Literal["code", "paper"]


@FILTERS.add("dror")
@dataclass(frozen=True)
class DROR(RadiusFilter):
    """Calls a point rain if it has few points around it for the spacing of beams at its range.

    Rain where fewer than ``neighbours`` points, itself included, lie within a radius that grows
    with the point's horizontal range ρ = √(x² + y²), and is ``minimum_radius`` at least:

    - variant ``code``, what the authors' program computes:
      ``radius_multiplier`` · 2 · ρ · sin(``azimuth_resolution``);
    - variant ``paper``, what their paper says:
      ``radius_multiplier`` · ρ · ``azimuth_resolution`` in radians.

    The resolution is 0.16° by default, as in the authors' launch file. The 0.04° of their class is
    finer than what spinning sensors step by: on the WADS sample it takes 40 % of the points that
    are no snow for snow, 0.16° takes 2 %.

    Example:
        >>> scan = derain.read_scan("scan.bin")  # a wall of 800 points and 20 drops before it
        >>> rain = derain.FilterDerainer(DROR())(scan)
        >>> int(rain.sum()), bool((scan.range[rain] < 15).all())
        (20, True)

    Attributes:
        neighbours: Points to be found, the point itself included.
        radius_multiplier: Beam spacings that make a radius.
        azimuth_resolution: Angle between neighbouring beams, degrees.
        minimum_radius: Smallest radius, metres.
        variant: ``code`` or ``paper``.

    Raises:
        InputError: Another variant, and as of :class:`derain.filters.PointFilter`.

    Source: N. Charron, S. Phillips and S. L. Waslander, "De-noising of Lidar Point Clouds Corrupted
        by Snowfall", CRV 2018, and github.com/nickcharron/lidar_snow_removal.
    """

    HELP: ClassVar[str] = "rain has few points within a radius that grows with range"
    # Of multiplier and resolution only the product counts: one of them is looked for.
    SPACE: ClassVar[Mapping[str, Span]] = {
        "neighbours": TUNED_NEIGHBOURS,
        "radius_multiplier": (0.3, 30.0),
        "minimum_radius": (0.005, 1.0),
    }

    neighbours: int = 3
    radius_multiplier: float = 3.0
    azimuth_resolution: float = 0.16
    minimum_radius: float = 0.04
    variant: Variant = "code"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.variant not in get_args(Variant):
            raise InputError(
                self.name,
                f"variant is {shown(self.variant)}",
                f"Give one of {', '.join(get_args(Variant))}.",
            )

    def radius_at(self, points: NDArray[np.float32]) -> NDArray[np.float64]:
        """The radius around each point; see :class:`RadiusFilter`."""
        x, y = points[:, :2].T.astype(np.float64)
        radius: NDArray[np.float64] = self._radius_per_metre * np.sqrt(x * x + y * y)
        return np.maximum(radius, self.minimum_radius)

    @property
    def _radius_per_metre(self) -> float:
        angle = math.radians(self.azimuth_resolution)
        spacing = 2 * math.sin(angle) if self.variant == "code" else angle
        return self.radius_multiplier * spacing
