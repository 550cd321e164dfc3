"""Where a sensor looked: inside the convex hull of the directions of its returns."""

import numpy as np
from numpy.typing import NDArray


def in_hull(
    points: tuple[NDArray[np.float64], NDArray[np.float64]],
    places: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> NDArray[np.bool_]:
    """Whether places lie in the convex hull of points, or on its edge.

    The hull of the returns never reaches beyond a field of view that is convex, be it a rectangle
    or a circle. It falls short of it where nothing returned near the edge, for example from the
    sky.

    Args:
        points: Azimuth and inclination of the returns, float64 (N,) each, N > 0, degrees, the
            azimuth without a jump inside the field of view.
        places: Azimuth and inclination of the places, float64 (M,) each, likewise.

    Returns:
        True for the places inside, bool (M,).
    """
    (azimuth, inclination), (across, up) = points, places
    inside: NDArray[np.bool_] = (across >= azimuth.min()) & (across <= azimuth.max())
    inside &= up <= np.interp(across, *_upper_hull(azimuth, inclination))
    inside &= -up <= np.interp(across, *_upper_hull(azimuth, -inclination))
    return inside


def _upper_hull(
    x: NDArray[np.float64], y: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Corners of the upper side of the convex hull, from left to right."""
    order = np.lexsort((y, x))
    x, y = x[order], y[order]
    highest = np.append(x[1:] > x[:-1], True)  # of the points at one x only the highest
    x, y = x[highest], y[highest]
    while True:
        run, rise = np.diff(x), np.diff(y)
        # A point on or below the line between its two neighbours is no corner of the hull. That
        # stays true when a neighbour is dropped in the same round, for the hull lies higher still.
        corner = np.ones(len(x), bool)
        corner[1:-1] = rise[1:] * run[:-1] < rise[:-1] * run[1:]
        if corner.all():
            return x, y
        x, y = x[corner], y[corner]
