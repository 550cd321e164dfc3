"""Counts of points and rays, the scores that follow from them, and the tables that they fill."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derain.evaluation.counts import (
    SCORES,
    Counts,
    intersection_over_union,
    mean_over_scans,
    ratio,
)
from derain.evaluation.ray_counts import RayCounts
from derain.evaluation.text_tables import markdown_table, number_text, plain_table
from derain.scan import Scan
from derain.views.returns import pair_returns

from ..two_returns import Recording

points = st.lists(st.tuples(st.booleans(), st.booleans()), max_size=30)
numbers = st.integers(0, 2**40)


@given(points)
def test_every_point_is_counted_as_what_it_is(pairs: list[tuple[bool, bool]]) -> None:
    called_rain, rain = np.array(pairs, bool).reshape(-1, 2).T
    outcomes = [(True, True), (True, False), (False, True), (False, False)]
    counts = Counts.of(called_rain, rain)
    assert counts == Counts(*map(pairs.count, outcomes))
    parts = (Counts.of(called_rain[half], rain[half]) for half in (slice(9), slice(9, None)))
    assert sum(parts, Counts()) == counts


@given(st.lists(st.tuples(numbers, numbers), min_size=1, max_size=9))
def test_many_scores_at_once_are_those_of_each_alone(pairs: list[tuple[int, int]]) -> None:
    hits, errors = np.array(pairs).T
    # Python divides integers with correct rounding.
    expected = [hit / (hit + error) if hit + error else math.nan for hit, error in pairs]
    for found in (
        intersection_over_union(hits, errors),
        ratio(hits, hits + errors),
        [Counts(hit, 0, error, 0).iou for hit, error in pairs],
        [Counts(hit, error, 0, 0).iou for hit, error in pairs],
    ):
        np.testing.assert_array_equal(found, expected)


def test_every_score_is_a_share_and_a_mean_leaves_out_scans_without_it() -> None:
    counts = Counts(3, 1, 2, 5)
    scores = [getattr(counts, score) for score in SCORES]
    assert scores == pytest.approx([3 / 4, 3 / 5, 2 / 3, 3 / 6])
    scans = [Counts(1, 1, 0, 8), Counts(0, 0, 0, 10), Counts(0, 1, 0, 9), Counts(0, 0, 2, 8)]
    means = [mean_over_scans(scans, score) for score in SCORES]
    assert means == pytest.approx([(1 / 2 + 0) / 2, (1 + 0) / 2, (2 / 3 + 0 + 0) / 3, 0.5 / 3])
    assert math.isnan(mean_over_scans(scans[1:2], "iou"))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("times", [1, 2])
def test_each_ray_counts_once_however_often_it_is_written(seed: int, times: int) -> None:
    recording = Recording(seed)
    rain = np.random.default_rng(seed).random(len(recording.ray)) < 0.3
    scan = Scan.of(np.tile(recording.xyz, (times, 1)))
    dual, met, given_back = 0, 0, 0
    rays = np.unique(recording.ray)
    for ray in rays:
        rows = np.flatnonzero(recording.ray == ray)
        rows = rows[np.argsort(recording.distance[rows])]
        dual += len(rows) == 2
        met += rain[rows[0]]
        given_back += len(rows) == 2 and rain[rows[0]] and not rain[rows[1]]
    counts = RayCounts.of(scan, pair_returns(scan), np.tile(rain, times))
    assert counts == RayCounts(len(rays), dual, met, given_back)
    assert (counts.dual_share, counts.given_back_share) == (dual / len(rays), given_back / met)
    assert RayCounts.of(scan, pair_returns(scan)) == RayCounts(len(rays), dual, 0, 0)


def test_a_return_whose_ray_met_something_that_is_no_row_has_met_no_rain() -> None:
    recording = Recording(0)
    _, nearer, farther = recording.truth()
    returns = {
        "return_number": np.where(farther, 2, 1).astype(np.uint8),
        "number_of_returns": np.where(recording.two, 2, 1).astype(np.uint8),
    }
    scan = Scan(recording.xyz, fields=returns).take(~nearer)
    counts = RayCounts.of(scan, pair_returns(scan), np.ones(len(scan), bool))
    assert counts == RayCounts(len(scan), int(farther.sum()), len(scan) - int(farther.sum()), 0)
    nothing = RayCounts(0, 0, 0, 0)
    assert (nothing.given_back_share, nothing.dual_share) == (0, 0)


def test_tables_line_up_and_a_number_that_is_undefined_is_a_dash() -> None:
    assert [*map(number_text, (0.12345, 0, math.nan, None))] == ["0.123", "0.000", "-", "-"]
    text = markdown_table(["method", "IoU"], [["a", "0.5"], ["longer one", "0.25"]])
    assert text.splitlines() == [
        "| method     |  IoU |",
        "|------------|-----:|",
        "| a          |  0.5 |",
        "| longer one | 0.25 |",
    ]
    text = plain_table([["", "all", "share"], ["scans", "12", ""], ["rain", "3", "25%"]])
    assert text.splitlines() == ["         all  share", "  scans   12", "  rain     3    25%"]
