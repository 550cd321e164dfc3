"""How far points lie from their neighbours, and how far is usual."""

import numpy as np
from numpy.typing import NDArray

from derain.views.neighbours import Neighbourhoods


def mean_distance(view: Neighbourhoods, neighbours: int) -> NDArray[np.float64]:
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


def usual_limit(distance: NDArray[np.float64], deviations: float) -> float:
    """Mean of two distances or more, plus so many of their standard deviations (of n - 1)."""
    return float(distance.mean() + deviations * distance.std(ddof=1))
