"""Decisions that each depend on those of the neighbours that were judged before."""

import numpy as np

from derain.scan import Bools, Float32s, Floats, Ints

# Features from -1 to 1 above the first are rain, and those up to the second are not, whatever the
# neighbours are.
# Source: CRFOR.
CERTAIN, RULED_OUT = 0.6, -0.4

# The vote of a neighbour is divided by its distance and this, metres.
# Source: CRFOR.
DISTANCE_FLOOR = 0.01


def decide_sequentially(
    feature: Floats,
    rows: Ints,
    place: Ints,
    neighbours: Ints,
    distances: Float32s,
    vote: float,
) -> Bools:
    """Judges points one after the other, each by its feature and by its neighbours.

    A point of an uncertain feature F is rain where F + Σ v / (0.01 m + d) > 0, over its neighbours
    at distances d. A neighbour's v is ``vote`` where it is rain and -``vote`` where it is not, as
    far as its feature or an earlier decision shows; else it is its feature.

    All points that may be rain start as rain. Then points turn, wave by wave. A turn
    bears on later points alone, and makes none of them rain; so the waves end where a loop over
    the points in their order would. Most points are decided once, whatever their neighbours are.

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
    is_earlier = _by_point(len(feature), rows, place)[others] < place
    feature_votes = np.where(rain, vote, np.where(feature < RULED_OUT, -vote, feature))[others]
    at_most = np.where(is_earlier, vote, feature_votes) * weights
    at_least = np.where(is_earlier, -vote, feature_votes) * weights
    own = feature[rows]
    is_rain = _total(own, at_most) > 0
    open_ = np.flatnonzero(is_rain & (_total(own, at_least) <= 0))
    number = _by_point(len(feature), rows, np.arange(len(rows)))[others[:, open_]]
    dependents = _Dependents(number, is_earlier[:, open_], len(rows))
    _turn_in_waves(is_rain, open_, own[open_], at_most[:, open_], at_least[:, open_], dependents)
    rain[rows] = is_rain
    return rain


def _turn_in_waves(
    is_rain: Bools,
    open_: Ints,
    own: Floats,
    votes: Floats,
    at_least: Floats,
    dependents: "_Dependents",
) -> None:
    """Turns points from rain to not rain, until none turns any more.

    Args:
        is_rain: Current state of the U uncertain points, bool (U,); decided in place.
        open_: Numbers of the H points whose verdicts are open, int64 (H,).
        own: Their features, float64 (H,).
        votes: The votes for them while all before them are rain, float64 (k - 1, H); changed in
            place.
        at_least: The votes for them where none before them is, float64 (k - 1, H).
        dependents: Points that depend on each decision.
    """
    turned = np.flatnonzero(~is_rain)
    while len(turned):
        column, dependent = dependents.of(turned)
        votes[column, dependent] = at_least[column, dependent]
        affected = np.unique(dependent[is_rain[open_[dependent]]])
        turned = open_[affected[_total(own[affected], votes[:, affected]) <= 0]]
        is_rain[turned] = False


def _by_point(points: int, rows: Ints, values: Ints) -> Ints:
    """Values of some points by their rows, and what is beyond them all for others, int64 (M,)."""
    by_point = np.full(points, np.iinfo(np.int64).max)
    by_point[rows] = values
    return by_point


def _total(own: Floats, votes: Floats) -> Floats:
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


class _Dependents:
    """Who hears of the decision on each of U uncertain points.

    Args:
        neighbours: Numbers of the neighbours of each of H hearers, int64 (k - 1, H).
        is_earlier: True for those that are uncertain and judged before it, bool (k - 1, H).
        uncertain: U.
    """

    def __init__(self, neighbours: Ints, is_earlier: Bools, uncertain: int) -> None:
        of = neighbours[is_earlier]
        order = np.argsort(of, kind="stable")
        self._column, self._dependent = (place[order] for place in np.nonzero(is_earlier))
        count = np.bincount(of, minlength=uncertain)
        self._end = np.cumsum(count)
        self._start = self._end - count

    def of(self, points: Ints) -> tuple[Ints, Ints]:
        """Who hears of the decisions on some points, and as which of its neighbours.

        Args:
            points: Numbers of the points, int64 (P,).

        Returns:
            Columns and hearers of every such pair, int64 each.
        """
        start, end = self._start[points], self._end[points]
        count = end - start
        before = np.cumsum(count) - count
        listed = np.repeat(start - before, count) + np.arange(count.sum())
        return self._column[listed], self._dependent[listed]
