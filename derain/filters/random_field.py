"""Decisions that each depend on those of the neighbours that were judged before."""

import numpy as np
from numpy.typing import NDArray

# Features from -1 to 1 above the first are rain, and those up to the second are not, whatever the
# neighbours are.
# Source: CRFOR.
CERTAIN, RULED_OUT = 0.6, -0.4

# The vote of a neighbour is divided by its distance and this, metres.
# Source: CRFOR.
DISTANCE_FLOOR = 0.01


def decide_sequentially(
    feature: NDArray[np.float64],
    rows: NDArray[np.int64],
    place: NDArray[np.int64],
    neighbours: NDArray[np.int64],
    distances: NDArray[np.float32],
    vote: float,
) -> NDArray[np.bool_]:
    """Judges points one after the other, each by its feature and by its neighbours.

    A point of an uncertain feature F is rain where F + Σ v / (0.01 m + d) > 0, over its neighbours
    at distances d. A neighbour's v is ``vote`` where it is rain and -``vote`` where it is not, as
    far as its feature or an earlier decision shows; else it is its feature.

    All that may be rain is taken for it first. Then what must turn is turned, wave by wave. A turn
    bears on later points alone, and makes none of them rain; so the waves end where a loop over
    the points in their order would.

    Args:
        feature: Feature of all points, float64 (M,), from -1 to 1.
        rows: Points that may be rain, int64 (Q,); the features of all others rule rain out.
        place: Place of each of these in the order of judgement, int64 (Q,).
        neighbours: Points in the neighbourhoods of these, the point itself first, int64 (Q, k).
        distances: Their distances, float32 (Q, k), metres.
        vote: See above.

    Returns:
        True for rain, bool (M,).
    """
    rain = feature > CERTAIN
    uncertain = np.flatnonzero((feature[rows] > RULED_OUT) & (feature[rows] <= CERTAIN))
    rows, place = rows[uncertain], place[uncertain]
    # A row for the nearest neighbours of all points, one for the next, and so on.
    others = np.ascontiguousarray(neighbours.take(uncertain, axis=0)[:, 1:].T)
    apart = np.array(distances.take(uncertain, axis=0)[:, 1:].T, np.float64, order="C")
    weights = 1 / (DISTANCE_FLOOR + apart)
    place_of_all = np.full(len(feature), np.iinfo(np.int64).max)
    place_of_all[rows] = place
    is_earlier = place_of_all[others] < place
    votes_by_feature = np.where(rain, vote, np.where(feature < RULED_OUT, -vote, feature))[others]
    at_most = np.where(is_earlier, vote, votes_by_feature) * weights
    at_least = np.where(is_earlier, -vote, votes_by_feature) * weights
    own = feature[rows]
    rain[rows] = _total(own, at_most) > 0
    # Most points are decided by now, whatever their neighbours are; only the others may turn.
    open_ = np.flatnonzero(rain[rows] & (_total(own, at_least) <= 0))
    rows, own, others, is_earlier = rows[open_], own[open_], others[:, open_], is_earlier[:, open_]
    at_most, at_least = at_most[:, open_], at_least[:, open_]
    turns = True
    while turns:
        votes = np.where(is_earlier & ~rain[others], at_least, at_most)
        stays_rain = _total(own, votes) > 0
        turns = bool((stays_rain != rain[rows]).any())
        rain[rows] = stays_rain
    return rain


def _total(own: NDArray[np.float64], votes: NDArray[np.float64]) -> NDArray[np.float64]:
    """The features of points and the votes for each, from the nearest neighbour on.

    Sums that are rounded in one order keep the order of their terms: where votes are less, the
    total is no more.

    Args:
        own: float64 (U,).
        votes: float64 (k - 1, U).
    """
    total = own.copy()
    for vote in votes:
        total += vote
    return total
