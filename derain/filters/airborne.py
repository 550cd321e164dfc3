"""Estimates of a scan's rain before any point is judged: its brightness and its range."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from derain.scan import Bools, Float32s, Floats, Ints
from derain.views.morton import evenly
from derain.views.scatter import scatter_through_space

# Neighbourhoods of some points, given by their rows: rows of points int64 (Q, k), the point itself
# first, and distances in metres, float32 (Q, k).
Around = Callable[[Ints], tuple[Ints, Float32s]]

# Points whose neighbourhoods are looked at.
SAMPLE = 4096

# Beyond, no LiDAR is known to see rain or snow, metres.
FARTHEST_RAIN = 60.0

# What is scattered through space by more than this, of 1/3, is on no surface.
OFF_SURFACES = 0.1

# Where less is in the air, it does not rain: so much and more is, where derain simulates at least
# 5 mm/h on dry scans of 64 and 128 beams. What is in the air of dry ones is at edges and in leaves.
LEAST_AIRBORNE = 0.01
FEWEST_AIRBORNE = 10

# What is in the air has to differ in intensity from what is not, or intensity shows nothing: the
# shares of both that are beyond some value have to differ by at least this (the distance of
# Kolmogorov and Smirnov). In rain that derain simulates on dry scans it is .49 to .87.
LEAST_DIFFERENCE = 0.4

# Share of what is in the air by which the reach of the rain is set; others may be stray.
SEEN = 0.95


@dataclass(frozen=True)
class RainBounds:
    """The bounds of a scan's rain.

    Attributes:
        intensity: Bound of its intensity, in the scan's own unit.
        is_bright: True if rain is above that bound; else it is at or below it.
        range: Distance that it is within, metres.
    """

    intensity: float
    is_bright: bool
    range: float

    def hold(self, intensity: Float32s, distance: NDArray[np.floating[Any]]) -> Bools:
        """True for points within the bounds, bool (M,).

        Args:
            intensity: Of each point, float32 (M,), in the scan's unit.
            distance: From the sensor, (M,), metres.
        """
        bright = intensity > self.intensity
        return (bright if self.is_bright else intensity <= self.intensity) & (
            distance <= self.range
        )


def fit_rain_bounds(
    xyz: Floats,
    distance: Floats,
    intensity: Float32s,
    may_be: Bools,
    around: Around,
    sparseness: float,
    reach: float,
) -> RainBounds | None:
    """Finds out from a scan itself how bright its rain is, and how far it is seen.

    Geometry alone gives a first sample of the rain: what is in the air is scattered through space,
    and sparse, its neighbours being farther off for its range than is usual in the scan. That finds
    less than half of the rain, but hardly anything else. By how the intensities of this sample
    differ from those of the others the bound is set, to either side: where the share of what is in
    the air and of what is not that lie beyond it differ most.

    Args:
        xyz: Distinct positions along a Morton curve, float64 (M, 3), metres.
        distance: Their distances from the sensor, float64 (M,), metres.
        intensity: Their intensities, float32 (M,); not numbers where the scan has none.
        may_be: Points that may be rain, such as those above the ground, bool (M,).
        around: Finds neighbourhoods.
        sparseness: Distance of a sparse point's neighbours, as a multiple of the usual one.
        reach: Largest range of rain, as a multiple of the range of most of the sample.

    Returns:
        The bounds; None where no intensity was measured, nothing is in the air, or what is differs
        from the rest in nothing.
    """
    may_tell = may_be & (distance < FARTHEST_RAIN) & ~np.isnan(intensity)
    rows = evenly(np.flatnonzero(may_tell), SAMPLE)
    if len(rows) < FEWEST_AIRBORNE:
        return None
    distance, intensity = distance[rows], intensity[rows]
    airborne = _is_airborne(xyz, distance, around(rows), sparseness)
    found = np.count_nonzero(airborne)
    if not max(FEWEST_AIRBORNE, LEAST_AIRBORNE * len(rows)) <= found < len(rows):
        return None
    bound, is_bright, difference = _greatest_difference(intensity, airborne)
    if difference < LEAST_DIFFERENCE:
        return None
    rain = airborne & RainBounds(bound, is_bright, FARTHEST_RAIN).hold(intensity, distance)
    return RainBounds(bound, is_bright, reach * float(np.quantile(distance[rain], SEEN)))


def _is_airborne(
    xyz: Floats,
    distance: Floats,
    neighbourhoods: tuple[Ints, Float32s],
    sparseness: float,
) -> Bools:
    """True for neighbourhoods that are scattered through space and sparse, bool (Q,)."""
    neighbours, distances = neighbourhoods
    spacing = distances.T.astype(np.float64).mean(axis=0) / distance
    sparse = spacing > sparseness * np.median(spacing)
    return np.asarray(sparse & (scatter_through_space(xyz, neighbours) > OFF_SURFACES))


def _greatest_difference(intensity: Float32s, airborne: Bools) -> tuple[float, bool, float]:
    """The bound that separates best what is in the air.

    Args:
        intensity: Intensities, float32 (Q,).
        airborne: True for points in the air, bool (Q,); some are, and some are not.

    Returns:
        The bound, whether what is in the air is brighter than it, and by how much the shares beyond
        it differ, of 1.
    """
    values = np.unique(intensity)
    of_air, of_others = (
        np.searchsorted(np.sort(intensity[part]), values, "right") / np.count_nonzero(part)
        for part in (airborne, ~airborne)
    )
    dimmer = of_air - of_others
    dimmest, brightest = int(dimmer.argmax()), int(dimmer.argmin())
    if dimmer[dimmest] >= -dimmer[brightest]:
        return float(values[dimmest]), False, float(dimmer[dimmest])
    return float(values[brightest]), True, float(-dimmer[brightest])
