"""Which points have few others around them, found without every point's neighbours.

Points that are next to each other along a Morton curve are near in space. Most points of a scan
have enough others within their radius among the next few along the curve, and need no search: it is
made for the remaining ones only.
"""

import numpy as np
from numpy.typing import NDArray

from derain.views.neighbour_search import NeighbourSearch

# Places along the curve that are looked at to either side of a point. Four settle 86 of 100 points
# of the WADS sample with DROR; eight settle one more, for twice the time.
CURVE_STEPS = 4

# Closer to the radius than this share of it, the search decides, so that rounding never does.
MARGIN = 1e-6


def has_few_neighbours(
    xyz: NDArray[np.float32],
    radius: NDArray[np.float64],
    count: int,
    threads: int,
    asked: NDArray[np.bool_] | None = None,
) -> NDArray[np.bool_]:
    """Finds the points that have fewer than ``count`` points within their radius.

    Args:
        xyz: Distinct positions along a Morton curve, float32 (M, 3), metres.
        radius: Metres, float64 (M,); a point at exactly this distance is within.
        count: Number of points, the point itself included.
        threads: Threads of the search.
        asked: Points that are asked about, bool (M,); None for all.

    Returns:
        bool (M,), False for points that are not asked about; the same in whatever order the points
        are, but sooner along a curve.
    """
    few = np.ones(len(xyz), bool) if asked is None else asked.copy()
    if len(xyz) < count or not few.any():
        return few
    places = xyz.astype(np.float64)
    few[_found_along_curve(places, radius * (1 - MARGIN)) >= count] = False
    unsettled = np.flatnonzero(few)
    if not len(unsettled):
        return few
    _, squared = NeighbourSearch(xyz, threads=threads).nearest(unsettled, count)
    # Rounded to float32 as the distances of the neighbour view are, so that a filter says the same
    # whether it judges alone or shares a view with others.
    distance = np.sqrt(squared[:, count - 1].astype(np.float32))
    few[unsettled] = distance > radius[unsettled]
    return few


def _found_along_curve(
    places: NDArray[np.float64], radius: NDArray[np.float64]
) -> NDArray[np.int64]:
    """Counts points within the radius: the point itself and CURVE_STEPS places to either side.

    Args:
        places: Positions in the order of the curve, float64 (M, 3), metres.
        radius: That of each point, metres, float64 (M,).

    Returns:
        At most as many as there are within the radius, int64 (M,).
    """
    columns, limit = np.ascontiguousarray(places.T), np.square(radius)
    found = np.ones(len(places), np.int64)
    # Every step writes into the same array, which is faster than to make one for each.
    room = np.empty_like(columns)
    for step in range(1, min(CURVE_STEPS, len(places) - 1) + 1):
        apart = np.subtract(columns[:, step:], columns[:, :-step], out=room[:, step:])
        squared = np.square(apart, out=apart).sum(axis=0)
        found[step:] += squared <= limit[step:]
        found[:-step] += squared <= limit[:-step]
    return found
