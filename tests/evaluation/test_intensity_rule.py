"""The rule that every derainer has to beat, against a search through all rules."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from derain.evaluation.hard_cases import hard_cases
from derain.evaluation.intensity_rule import IntensityRule
from derain.scan import Scan

HARD_CASES = dict(hard_cases(largest=5000))


def iou(predicted: NDArray[np.bool_], rain: NDArray[np.bool_]) -> float:
    union = np.count_nonzero(predicted | rain)
    return np.count_nonzero(predicted & rain) / union if union else 1.0


def random_scan(seed: int, points: int, levels: int = 1000) -> tuple[Scan, NDArray[np.bool_]]:
    """Points of so many different ranges and intensities, and their rain: more of the near."""
    generator = np.random.default_rng(seed)
    columns = np.zeros((points, 4))
    columns[:, 0] = generator.integers(1, levels + 1, points) * 0.7
    columns[:, 3] = generator.integers(0, levels, points) * 0.1
    share = 0.8 - 0.7 * columns[:, 0] / columns[:, 0].max()
    return Scan.of(columns), generator.random(points) < share


@given(st.integers(0, 2**32), st.integers(1, 30), st.integers(1, 3), st.sampled_from([6, 1000]))
@settings(deadline=None)
def test_no_other_rule_is_better_than_the_best(
    seed: int, points: int, scans: int, levels: int
) -> None:
    truth = [random_scan(seed + number, points, levels) for number in range(scans)]
    whole = Scan.of(
        np.concatenate([np.c_[scan.xyz, scan.intensity] for scan, _ in truth]),
    )
    rain = np.concatenate([rain for _, rain in truth])
    dim, near = (column <= column[:, None] for column in (whole.intensity, whole.range))
    best = max(iou(predicted, rain) for row in dim for predicted in row & near)
    found = IntensityRule.best(truth)(whole)
    assert iou(found, rain) == best if rain.any() else not found.any()


def test_dim_and_near_points_are_rain() -> None:
    scan = Scan.of(np.array([[1, 0, 0, 5], [0, 3, 0, 5], [0, 0, 2, 6], [2, 0, 0, 5.5]]))
    assert IntensityRule(intensity=5.5, range=2)(scan).tolist() == [True, False, False, True]


def test_points_that_cannot_be_judged_are_not_rain() -> None:
    scan = Scan.of(np.array([[0, 0, 0, 0], [-1, -1, -1, -1], [np.nan, 0, 0, 0], [1, 0, 0, 0.0]]))
    assert IntensityRule(intensity=255, range=100)(scan).tolist() == [False, False, False, True]


def test_points_that_cannot_be_judged_teach_nothing() -> None:
    scan, rain = random_scan(seed=1, points=60)
    broken = np.full((500, 4), np.nan, np.float32)
    broken[::2] = 0
    padded = Scan.of(np.concatenate([np.c_[scan.xyz, scan.intensity], broken]))
    everywhere = np.concatenate([rain, np.ones(500, bool)])
    assert IntensityRule.best([(padded, everywhere)]) == IntensityRule.best([(scan, rain)])


def test_a_scan_without_intensity_has_no_dim_points_and_teaches_nothing() -> None:
    bare = Scan(np.ones((4, 3), np.float32))
    assert not IntensityRule(intensity=np.inf, range=np.inf)(bare).any()
    taught = random_scan(seed=2, points=60)
    assert IntensityRule.best([(bare, np.ones(4, bool)), taught]) == IntensityRule.best([taught])


@pytest.mark.parametrize("scans", [[], ["no intensity"], ["empty"], ["nothing valid"]], ids=str)
def test_where_there_is_no_rain_to_learn_from_nothing_is_found(scans: list[str]) -> None:
    cases = [HARD_CASES[name] for name in scans]
    rule = IntensityRule.best((scan, np.ones(len(scan), bool)) for scan in cases)
    assert not rule(random_scan(seed=3, points=60)[0]).any()


def test_on_real_snow_the_rule_reaches_its_published_quality(shared: Path) -> None:
    points = np.fromfile(shared / "data/wads/sample.bin", np.float32).reshape(-1, 4)
    snow = np.fromfile(shared / "data/wads/sample.label", np.uint32) & 0xFFFF == 110
    scan = Scan.of(points)
    stated = iou(IntensityRule(intensity=0, range=20)(scan), snow)
    assert stated == pytest.approx(0.72, abs=0.005)
    assert iou(IntensityRule.best([(scan, snow)])(scan), snow) > stated
