"""How points near each other agree: drops fly among drops, and surfaces hang together."""

import numpy as np
from numpy.typing import NDArray

from derain.recordings.known_points import ScanPoints

# Half as much as the point itself counts a neighbour at this distance, metres, and metres more for
# each metre of range, a step of a sensor of 64 beams.
HALF_AT = (0.1, 0.01)

# However sure a point is, it does not outvote more neighbours than this makes: log-odds.
LARGEST_LOG_ODDS = 4.0


def vote(points: ScanPoints, log_odds: NDArray[np.float64]) -> NDArray[np.float64]:
    """Log-odds of rain of each point and its neighbours together.

    Args:
        points: M points.
        log_odds: What speaks for rain at each point by itself, float64 (M,).

    Returns:
        float64 (M,).
    """
    offset, slope = HALF_AT
    half_at = (offset + slope * points.range)[:, None]
    weight = 1 / (1 + np.square(points.distances / half_at))
    votes = np.clip(log_odds, -LARGEST_LOG_ODDS, LARGEST_LOG_ODDS).take(points.neighbours)
    total: NDArray[np.float64] = (weight * votes).sum(axis=1)
    return total
