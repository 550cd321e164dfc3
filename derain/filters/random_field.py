"""Decisions that each depend on those of the neighbours that were judged before."""

import numpy as np
from numpy.typing import NDArray

# Features from -1 to 1 above the first are rain, and those up to the second are not, whatever the
# neighbours say.
# Source: CRFOR.
CERTAIN, RULED_OUT = 0.6, -0.4

# What a neighbour says is divided by its distance and this, metres.
# Source: CRFOR.
AT_LEAST_APART = 0.01


def decide_in_turn(
    feature: NDArray[np.float64],
    place: NDArray[np.int64],
    rows: NDArray[np.int64],
    neighbours: NDArray[np.int64],
    distances: NDArray[np.float32],
    vote: float,
) -> NDArray[np.bool_]:
    """Judges points one after the other, each by its feature and by its neighbours.

    A point of an uncertain feature F is rain where F + Σ v / (0.01 m + d) > 0, over its neighbours
    at distances d. A neighbour's v is ``vote`` where it is rain and -``vote`` where it is not, as
    far as its feature or an earlier decision says; else it is its feature.

    All that may be rain is taken for it first. Then what must turn is turned, wave by wave. A turn
    bears on later points alone, and makes none of them rain; so the waves end where a loop over
    the points in their order would.

    Args:
        feature: Feature of all points, float64 (M,), from -1 to 1.
        place: Place of each point in the order of judgement, int64 (M,).
        rows: Points that may be rain, int64 (Q,); the features of all others rule rain out.
        neighbours: Points in the neighbourhoods of these, the point itself first, int64 (Q, k).
        distances: Their distances, float32 (Q, k), metres.
        vote: See above.

    Returns:
        True for rain, bool (M,).
    """
    rain = feature > CERTAIN
    uncertain = (feature[rows] > RULED_OUT) & (feature[rows] <= CERTAIN)
    rows = rows[uncertain]
    others = np.ascontiguousarray(neighbours[uncertain, 1:].T)
    weights = 1 / (AT_LEAST_APART + distances[uncertain, 1:].T.astype(np.float64))
    said = np.where(rain, vote, np.where(feature < RULED_OUT, -vote, feature))
    number = np.full(len(feature), -1)
    number[rows] = np.arange(len(rows))
    is_earlier = (number[others] >= 0) & (place[others] < place[rows])
    later = _Later(number[others], is_earlier)
    # What is said to each point, once all uncertain ones before it are taken for rain.
    to_points = np.where(is_earlier, vote, said[others]) * weights
    is_rain = np.ones(len(rows), bool)
    asked = np.arange(len(rows))
    while len(asked):
        total = feature[rows[asked]]
        for heard in to_points[:, asked]:  # in this order, on which the rounding depends
            total = total + heard
        turned = asked[total <= 0]
        is_rain[turned] = False
        column, point = later.than(turned)
        to_points[column, point] = -vote * weights[column, point]
        asked = np.unique(point[is_rain[point]])
    rain[rows] = is_rain
    return rain


class _Later:
    """Who hears of the decision on each of U uncertain points.

    Args:
        neighbours: Numbers of the neighbours of each, int64 (k - 1, U).
        is_earlier: Which of these are uncertain and judged before it, bool (k - 1, U).
    """

    def __init__(self, neighbours: NDArray[np.int64], is_earlier: NDArray[np.bool_]) -> None:
        self._column, self._point = np.nonzero(is_earlier)
        order = np.argsort(neighbours[is_earlier], kind="stable")
        self._column, self._point = self._column[order], self._point[order]
        count = np.bincount(neighbours[is_earlier], minlength=neighbours.shape[1])
        self._end = np.cumsum(count)
        self._start = self._end - count

    def than(self, points: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Who hears of the decisions on some points: which neighbour each is, and of whom."""
        start, end = self._start[points], self._end[points]
        count = end - start
        before = np.cumsum(count) - count
        listed = np.repeat(start - before, count) + np.arange(count.sum())
        return self._column[listed], self._point[listed]
