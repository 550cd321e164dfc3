"""Intervals over scans: checked against drawing scans one by one, and where they must collapse."""

import numpy as np

from derain.export.bench import rows as module
from derain.export.bench.rows import bootstrap


def test_intervals_agree_with_drawing_scans_one_by_one(monkeypatch) -> None:
    monkeypatch.setattr(module, "DRAWS", 20_000)
    draws = generator(1)
    found, errors = draws.integers(0, 1000, (2, 3, 12))
    intervals, behind_best = bootstrap(found, errors, np.random.default_rng(2))

    rows = draws.integers(0, 12, (20_000, 12))
    hits, misses = found[:, rows].sum(axis=2), errors[:, rows].sum(axis=2)
    iou = hits / (hits + misses)
    pooled = found.sum(axis=1) / (found + errors).sum(axis=1)
    behind = iou[pooled.argmax()] - iou
    np.testing.assert_allclose(intervals, np.percentile(iou, [2.5, 97.5], axis=1).T, atol=0.01)
    np.testing.assert_allclose(behind_best, np.percentile(behind, [2.5, 97.5], axis=1).T, atol=0.01)


def test_a_method_that_is_worse_on_every_scan_is_recognised_though_scans_differ_more() -> None:
    found = np.array([[90, 50, 10, 70, 30, 20], [88, 48, 8, 68, 28, 18]])
    intervals, behind_best = bootstrap(found, 100 - found, generator(0))
    (low, high), _ = intervals
    assert high - low > 0.3
    assert behind_best[0] == (0.0, 0.0)
    low, high = behind_best[1]
    assert 0 < low <= high < 0.03


def test_draws_and_methods_without_an_iou_are_left_out() -> None:
    found, errors = np.array([[0, 0], [0, 0]]), np.array([[0, 0], [2, 3]])
    intervals, behind_best = bootstrap(found, errors, generator(0))
    assert intervals == behind_best == [None, (0.0, 0.0)]
    # One of two scans has no rain, and the method finds none there: every fourth draw has no IoU.
    intervals, _ = bootstrap(np.array([[3, 0]]), np.array([[1, 0]]), generator(0))
    assert intervals == [(0.75, 0.75)]


def generator(seed: int) -> np.random.Generator:
    return np.random.default_rng(seed)
