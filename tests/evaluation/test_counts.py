"""Counts of points against scikit-learn and by hand, and the tables that they fill.

That two processes count what one counts is proved by `tests/models/test_processes.py`.
"""

import math
import pickle
from functools import partial

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from sklearn import metrics

from derain.cards.card import DataCard
from derain.errors import InputError
from derain.evaluation.counts import SCORES, ClassCounts, Counts, RainCounts, mean_over_scans
from derain.evaluation.metrics import RainMetrics
from derain.evaluation.text_tables import markdown_table, number_text, plain_table
from derain.scan import Bools, Scan

CLASSES = {0: "ground", 3: "rain", 7: "car", 110: "snow", 255: "nobody knows"}
RAIN = (3, 110)
CARD = DataCard("ours", CLASSES, RAIN, unknown=(255,))
approx = partial(pytest.approx, nan_ok=True)


@given(st.lists(st.tuples(st.booleans(), st.booleans()), max_size=30))
def test_every_point_is_counted_as_what_it_is(pairs) -> None:
    called_rain, rain = np.array(pairs, bool).reshape(-1, 2).T
    outcomes = [(True, True), (True, False), (False, True), (False, False)]
    counts = Counts.of(called_rain, rain)
    assert counts == Counts(*map(pairs.count, outcomes))
    parts = (Counts.of(called_rain[half], rain[half]) for half in (slice(9), slice(9, None)))
    assert sum(parts, Counts()) == counts


def test_a_mean_over_scans_leaves_out_scans_without_the_score() -> None:
    scans = [Counts(1, 1, 0, 8), Counts(0, 0, 0, 10), Counts(0, 1, 0, 9), Counts(0, 0, 2, 8)]
    means = [mean_over_scans(scans, score) for score in SCORES]
    assert means == pytest.approx([(1 / 2 + 0) / 2, (1 + 0) / 2, (2 / 3 + 0 + 0) / 3, 0.5 / 3])
    assert math.isnan(mean_over_scans(scans[1:2], "iou"))


def labelled(seed: int, points: int) -> tuple[Scan, Bools]:
    """A scan with points on the edges of bands and points without a return, and an answer."""
    random = np.random.default_rng(seed)
    xyz = random.uniform(-90, 90, (points, 3)).astype(np.float32)
    xyz[random.random(points) < 0.1] = (20, 0, 0)
    xyz[random.random(points) < 0.05] = np.nan
    label = random.choice(list(CLASSES), points)
    return Scan(xyz).with_label(label), np.isin(label, RAIN) ^ (random.random(points) < 0.3)


def reference(truth: Bools, called: Bools) -> list[float]:
    """The four scores as scikit-learn computes them, which takes no empty arrays."""
    if not len(truth):
        return [math.nan] * 4
    functions = (metrics.precision_score, metrics.recall_score, metrics.f1_score)
    scores = [float(score(truth, called, zero_division=math.nan)) for score in functions]
    # This one takes no NaN.
    iou = metrics.jaccard_score(truth, called) if (truth | called).any() else math.nan
    return [*scores, float(iou)]


@pytest.mark.parametrize("points", [(), (0,), (1, 50, 50), (2, 2, 2, 2), (0, 40)])
def test_scores_are_those_of_scikit_learn_and_all_counts_add_up(points) -> None:
    counts = RainCounts(CARD)
    truths, answers = [np.zeros(0, bool)], [np.zeros(0, bool)]
    for scan, called in (labelled(*one) for one in enumerate(points)):
        counts.add(scan, called)
        known = scan.label != 255
        truths.append(np.isin(scan.label[known], RAIN))
        answers.append(called[known])
    groups = [*counts.per_scan, counts.pooled]
    pairs = [*zip(truths[1:], answers[1:], strict=True)]
    pairs.append((np.concatenate(truths), np.concatenate(answers)))
    for group, pair in zip(groups, pairs, strict=True):
        assert [getattr(group, score) for score in SCORES] == approx(reference(*pair), rel=1e-12)
    assert counts.pooled == sum(counts.per_scan, Counts())
    assert counts.pooled == sum(counts.by_range.values(), Counts())


def test_points_are_counted_by_class_and_by_the_band_that_begins_at_an_edge() -> None:
    counts = RainCounts(CARD)
    x = np.array([3, 9.99, 10, 39.9, 80, 1e9, np.inf, np.nan, 1])
    label = np.array([3, 0, 0, 3, 0, 0, 110, 7, 255])
    called = np.array([1, 1, 0, 0, 0, 1, 0, 0, 1], bool)
    counts.add(
        Scan(np.stack([x, 0 * x, 0 * x], axis=1).astype(np.float32)).with_label(label), called
    )
    assert counts.by_range == {
        "0-10 m": Counts(1, 1, 0, 0),
        "10-20 m": Counts(0, 0, 0, 1),
        "20-40 m": Counts(0, 0, 1, 0),
        "40-80 m": Counts(),
        "80+ m": Counts(0, 1, 1, 2),
    }
    by_class = counts.by_class
    assert by_class == {
        "ground": ClassCounts(4, 2, rain=False),
        "rain": ClassCounts(2, 1, rain=True),
        "car": ClassCounts(1, 0, rain=False),
        "snow": ClassCounts(1, 0, rain=True),
    }
    assert by_class["rain"].share_lost == by_class["rain"].share_wrong == 0.5
    assert counts.pooled_over([3, 7]) == Counts(1, 0, 1, 1)


def test_what_cannot_be_counted_is_refused() -> None:
    counts = RainCounts(DataCard("two", {0: "ground", 3: "rain"}, (3,)))
    scan = Scan(np.ones((1, 3), np.float32))
    with pytest.raises(InputError, match="no labels"):
        counts.add(scan, np.array([True]))
    with pytest.raises(InputError, match="id 9"):
        counts.add(scan.with_label(np.array([9])), np.array([True]))
    assert counts.per_scan == []


def test_a_metric_counts_alike_in_any_precision_and_forgets_when_reset() -> None:
    metric, expected = RainMetrics(CARD), RainCounts(CARD)
    for number in range(3):
        scan, called = labelled(number, 60)
        metric.update(scan, called)
        expected.add(scan, called)
        metric = pickle.loads(pickle.dumps(metric)).to(torch.bfloat16)
    counts = metric.counts()
    np.testing.assert_array_equal(counts.cells, expected.cells)
    assert counts.per_scan == expected.per_scan
    computed = metric.compute()
    assert {(value.shape, value.dtype) for value in computed.values()} == {((), torch.float32)}
    for score in SCORES:
        assert computed[score] == pytest.approx(getattr(expected.pooled, score))
        mean = mean_over_scans(expected.per_scan, score)
        assert computed[f"{score}_per_scan"] == pytest.approx(mean)
    metric.reset()
    assert metric.counts().per_scan == []
    assert metric.counts().pooled == Counts()


def test_tables_line_up_and_a_number_that_is_undefined_is_a_dash() -> None:
    assert [*map(number_text, (0.12345, 0, math.nan, None))] == ["0.123", "0.000", "-", "-"]
    assert markdown_table(["a|b"], [["c\nd"]]).splitlines() == ["| a\\|b |", "|------|", "| c d  |"]
    text = markdown_table(["method", "IoU"], [["a", "0.5"], ["longer one", "0.25"]])
    assert text.splitlines() == [
        "| method     |  IoU |",
        "|------------|-----:|",
        "| a          |  0.5 |",
        "| longer one | 0.25 |",
    ]
    text = plain_table([["", "all", "share"], ["scans", "12", ""], ["rain", "3", "25%"]])
    assert text.splitlines() == ["         all  share", "  scans   12", "  rain     3    25%"]
