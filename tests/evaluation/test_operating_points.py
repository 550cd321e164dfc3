"""Precision and recall at many thresholds: against counting each of them alone."""

import numpy as np
import pytest

from derain.evaluation.counts import Counts
from derain.evaluation.operating_points import CURVE_THRESHOLDS, ThresholdCounts


def drawn(seed: int, points: int = 500) -> tuple[np.ndarray, np.ndarray]:
    """Probabilities, some on thresholds and at both ends, and whether it is rain."""
    rng = np.random.default_rng(seed)
    rain = rng.random(points) < 0.2
    probability = np.clip(rng.normal(np.where(rain, 0.9, 0.05), 0.3), 0, 1).astype(np.float32)
    probability[::10] = rng.choice(CURVE_THRESHOLDS, len(probability[::10]))
    probability[5::50] = 1 - 1e-6
    return probability, rain


def counted(*scans: tuple[np.ndarray, np.ndarray], chosen: float = 0.37) -> ThresholdCounts:
    metric = ThresholdCounts([chosen])
    for probability, rain in scans:
        metric.update(probability, rain)
    return metric


def test_every_threshold_counts_as_it_would_alone() -> None:
    scans = [drawn(0), drawn(1, 300), drawn(2, 0)]
    points = counted(*scans, chosen=1 / 3).points()
    probability, rain = (np.concatenate(part) for part in zip(*scans, strict=True))
    assert points.thresholds[0] == 0
    assert points.thresholds[-1] == 1
    assert (np.diff(points.thresholds) > 0).all()
    assert points.thresholds[points.at(1 / 3)] == 1 / 3
    assert points.counts(0) == Counts.of(np.ones(len(rain), bool), rain)
    for number, threshold in enumerate(points.thresholds.tolist()[1:], 1):
        counts = Counts.of(probability > threshold, rain)
        assert points.counts(number) == counts
        for score in ("precision", "recall", "iou"):
            value = pytest.approx(getattr(counts, score), nan_ok=True)
            assert getattr(points, score)[number] == value
    best = points.counts(points.best)
    assert best.iou == max(points.counts(n).iou for n in range(len(points.thresholds)))


def test_the_average_precision_is_that_of_the_definition() -> None:
    points = counted(drawn(3)).points()
    # Sum of (R_n - R_{n-1}) P_n from the greatest threshold to the smallest.
    area, recall = 0.0, 0.0
    for number in reversed(range(len(points.thresholds))):
        counts = points.counts(number)
        if counts.recall > recall:  # else the precision may be undefined
            area += (counts.recall - recall) * counts.precision
        recall = counts.recall
    assert points.average_precision == pytest.approx(area)
    assert float(counted(drawn(3)).compute()["average_precision"]) == pytest.approx(area)


def test_a_perfect_answer_has_all_precision_and_without_rain_there_is_none() -> None:
    rain = np.arange(1000) < 100
    perfect = counted((rain.astype(np.float32), rain)).points()
    assert perfect.average_precision == 1
    assert 0 < perfect.thresholds[perfect.best] < 1
    dry = counted((np.full(10, 0.5, np.float32), np.zeros(10, bool))).points()
    assert np.isnan(dry.average_precision)


def test_the_thresholds_of_a_curve_are_among_those_that_are_counted() -> None:
    points = counted(drawn(4)).points()
    rows = np.searchsorted(points.thresholds, CURVE_THRESHOLDS)
    np.testing.assert_array_equal(points.thresholds[rows], CURVE_THRESHOLDS)
