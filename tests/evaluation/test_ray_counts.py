"""Rays are counted one by one, and so is what lies behind rain."""

import numpy as np
import pytest

from derain.evaluation.ray_counts import RayCounts
from derain.scan import Scan
from derain.views.returns import pair_returns

from ..two_returns import Recording


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("times", [1, 2])
def test_each_ray_counts_once_however_often_it_is_written(seed: int, times: int) -> None:
    recording = Recording(seed)
    rain = np.random.default_rng(seed).random(len(recording.ray)) < 0.3
    scan = Scan.of(np.tile(recording.xyz, (times, 1)))
    counts = RayCounts.of(scan, pair_returns(scan), np.tile(rain, times))
    dual, met, given_back = 0, 0, 0
    rays = np.unique(recording.ray)
    for ray in rays:
        rows = np.flatnonzero(recording.ray == ray)
        rows = rows[np.argsort(recording.distance[rows])]
        dual += len(rows) == 2
        met += rain[rows[0]]
        given_back += len(rows) == 2 and rain[rows[0]] and not rain[rows[1]]
    assert counts == RayCounts(len(rays), dual, met, given_back)
    assert counts.dual_share == dual / len(rays)
    assert counts.given_back_share == given_back / met
    assert RayCounts.of(scan, pair_returns(scan)) == RayCounts(len(rays), dual, 0, 0)


def test_a_return_whose_ray_met_something_that_is_no_row_has_met_no_rain() -> None:
    recording = Recording(0)
    _, nearer, farther = recording.truth()
    numbers = {
        "return_number": np.where(farther, 2, 1).astype(np.uint8),
        "number_of_returns": np.where(recording.two, 2, 1).astype(np.uint8),
    }
    scan = Scan(recording.xyz, fields=numbers).take(~nearer)
    counts = RayCounts.of(scan, pair_returns(scan), np.ones(len(scan), bool))
    assert counts == RayCounts(len(scan), int(farther.sum()), len(scan) - int(farther.sum()), 0)


def test_shares_of_nothing_are_zero() -> None:
    scan = Scan.of(np.full((3, 4), np.nan))
    counts = RayCounts.of(scan, pair_returns(scan), np.ones(3, bool))
    assert (counts.given_back_share, counts.dual_share) == (0, 0)
