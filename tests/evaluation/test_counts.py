"""Counts of points, and the scores that every table, tuning and picture takes from them."""

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

points = st.lists(st.tuples(st.booleans(), st.booleans()), max_size=30)
numbers = st.integers(0, 2**40)


def counted(pairs: list[tuple[bool, bool]]) -> Counts:
    called_rain, rain = np.array(pairs, bool).reshape(-1, 2).T
    return Counts.of(called_rain, rain)


@given(points)
def test_every_point_is_counted_as_what_it_is(pairs: list[tuple[bool, bool]]) -> None:
    outcomes = [(True, True), (True, False), (False, True), (False, False)]
    assert counted(pairs) == Counts(*map(pairs.count, outcomes))


@given(points, points)
def test_counts_of_parts_add_up(
    first: list[tuple[bool, bool]], second: list[tuple[bool, bool]]
) -> None:
    assert counted(first) + counted(second) == counted(first + second)


@given(st.lists(st.tuples(numbers, numbers), min_size=1, max_size=9))
def test_many_scores_at_once_are_those_of_each_alone(pairs: list[tuple[int, int]]) -> None:
    hits, errors = np.array(pairs).T
    # Python divides integers with correct rounding.
    expected = [hit / (hit + error) if hit + error else math.nan for hit, error in pairs]
    for found in (
        intersection_over_union(hits, errors),
        [Counts(hit, 0, error, 0).iou for hit, error in pairs],
        [Counts(hit, error, 0, 0).iou for hit, error in pairs],
    ):
        np.testing.assert_array_equal(found, expected)


def test_a_share_of_nothing_is_undefined() -> None:
    np.testing.assert_array_equal(ratio([1, 0], [2, 0]), [0.5, math.nan])


def test_a_mean_over_scans_leaves_out_those_without_the_score() -> None:
    scans = [Counts(1, 1, 0, 8), Counts(0, 0, 0, 10), Counts(0, 1, 0, 9), Counts(0, 0, 2, 8)]
    means = [mean_over_scans(scans, score) for score in SCORES]
    assert means == pytest.approx([(1 / 2 + 0) / 2, (1 + 0) / 2, (2 / 3 + 0 + 0) / 3, 0.5 / 3])
    assert math.isnan(mean_over_scans(scans[1:2], "iou"))
    assert math.isnan(mean_over_scans([], "iou"))


@pytest.mark.parametrize("score", SCORES)
def test_every_score_is_a_share(score: str) -> None:
    assert getattr(Counts(3, 1, 2, 5), score) == pytest.approx(
        {"precision": 3 / 4, "recall": 3 / 5, "f1": 2 / 3, "iou": 3 / 6}[score]
    )
