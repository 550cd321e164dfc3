"""Counts in NumPy are those of the metric that training measures by, and refuse the same."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derain.errors import InputError
from derain.evaluation.counts import Counts
from derain.evaluation.metrics import RainMetrics
from derain.evaluation.rain_counts import ClassCounts, RainCounts
from derain.scan import Scan

CLASSES = {0: "ground", 3: "rain", 7: "car", 110: "snow", 255: "nobody knows"}
RAIN = (3, 110)


def labelled(seed: int, points: int) -> tuple[Scan, np.ndarray]:
    """A scan with edges of bands and points that are nowhere, and an answer."""
    random = np.random.default_rng(seed)
    xyz = random.uniform(-90, 90, (points, 3)).astype(np.float32)
    xyz[random.random(points) < 0.1] = (20, 0, 0)
    xyz[random.random(points) < 0.05] = np.nan
    label = random.choice(list(CLASSES), points)
    return Scan(xyz).with_label(label), random.random(points) < 0.4


@given(st.lists(st.tuples(st.integers(0, 2**32 - 1), st.integers(0, 50)), max_size=4))
def test_they_are_the_counts_of_the_metric(scans: list[tuple[int, int]]) -> None:
    counts = RainCounts(CLASSES, RAIN, unknown=[255])
    metrics = RainMetrics(CLASSES, RAIN, unknown=[255])
    for seed, points in scans:
        scan, called_rain = labelled(seed, points)
        counts.add(scan, called_rain)
        metrics.update_scan(scan, called_rain)
    assert counts.pooled() == metrics.pooled() == sum(counts.per_scan(), Counts())
    assert counts.per_scan() == metrics.per_scan()
    assert counts.by_class() == metrics.by_class()
    assert counts.by_range() == metrics.by_range()


def test_points_are_counted_by_class_and_by_the_band_that_begins_at_an_edge() -> None:
    counts = RainCounts(CLASSES, RAIN, range_edges=(0, 10), unknown=[255])
    scan = Scan(np.array([[3, 0, 0], [0, 10, 0], [0, 0, np.inf], [1, 0, 0]], np.float32))
    counts.add(scan.with_label(np.array([3, 0, 110, 255])), np.array([True, True, False, True]))
    assert counts.by_range() == {"0-10 m": Counts(1, 0, 0, 0), "10+ m": Counts(0, 1, 1, 0)}
    assert counts.by_class()["rain"] == ClassCounts(1, 1, rain=True)
    assert counts.by_class()["ground"] == ClassCounts(1, 1, rain=False)
    assert "nobody knows" not in counts.by_class()


def test_what_cannot_be_counted_is_refused() -> None:
    counts = RainCounts({0: "ground", 3: "rain"}, [3])
    scan = Scan(np.ones((1, 3), np.float32))
    with pytest.raises(InputError, match="has no labels"):
        counts.add(scan, np.array([True]))
    with pytest.raises(InputError, match="id 9 is no known class"):
        counts.add(scan.with_label(np.array([9])), np.array([True]))
    assert counts.per_scan() == []
    for classes, rain, edges in (
        ({0: "a", 1: "a"}, [0], (0,)),
        ({0: "a"}, [5], (0,)),
        ({0: "a"}, [0], (1, 2)),
    ):
        with pytest.raises(InputError):
            RainCounts(classes, rain, edges)
