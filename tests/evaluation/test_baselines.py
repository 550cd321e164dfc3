"""The baselines, against a search through all choices of voxels and through all rules."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derain.evaluation.baselines import IntensityRule, PositionPrior, all_points, no_points
from derain.evaluation.counts import Counts
from derain.evaluation.hard_cases import hard_cases
from derain.scan import Bools, Scan

Truth = tuple[Scan, Bools]


def iou(predicted: Bools, rain: Bools) -> float:
    return Counts.of(predicted, rain).iou


def in_voxels(voxels: list[int], rain: list[bool]) -> Truth:
    """Points in the middle of voxels of half a metre along x."""
    x = np.asarray(voxels) / 2 + 0.25
    return Scan.of(np.stack([x, x * 0, x * 0 + 1], axis=1)), np.asarray(rain, bool)


@st.composite
def truths(draw: st.DrawFn) -> list[Truth]:
    """Scans of few voxels, with some rain among them."""
    of_scan = st.lists(st.tuples(st.integers(-4, 4), st.booleans()), max_size=12)
    scans = draw(st.lists(of_scan, min_size=1, max_size=4))
    return [in_voxels([v for v, _ in points], [r for _, r in points]) for points in scans]


@given(truths())
def test_no_other_choice_by_share_is_better_on_the_training_scans(scans) -> None:
    x = np.concatenate([scan.xyz[:, 0] for scan, _ in scans])
    rain = np.concatenate([rain for _, rain in scans])
    prior = PositionPrior.learn(scans)
    np.testing.assert_array_equal(prior.rain, PositionPrior.learn(scans[::-1]).rain)
    predicted = np.concatenate([prior(scan) for scan, _ in scans])
    voxels = np.unique(x)
    if not rain.any():
        assert not predicted.any()
        return
    # A point more in every voxel, which is rain as much as the average point.
    share = {
        voxel: (rain[x == voxel].sum() + rain.mean()) / ((x == voxel).sum() + 1) for voxel in voxels
    }
    by_share = [
        np.isin(x, [voxel for voxel in voxels if share[voxel] >= limit - 1e-12])
        for limit in share.values()
    ]
    assert iou(predicted, rain) == max(iou(choice, rain) for choice in by_share)


def test_hard_scans_get_an_answer_and_points_that_cannot_be_judged_teach_nothing() -> None:
    for name, scan in hard_cases(largest=5000):
        rain = np.random.default_rng(0).random(len(scan)) < 0.5
        prior, rule = PositionPrior.learn([(scan, rain)]), IntensityRule.best([(scan, rain)])
        for called in (prior(scan), rule(scan)):
            assert (called.shape, called.dtype) == ((len(scan),), bool), name
            assert not called[~scan.valid].any(), name
        np.testing.assert_array_equal(all_points(scan), scan.valid)
        np.testing.assert_array_equal(no_points(scan), np.zeros(len(scan), bool))
        valid = [(scan.take(scan.valid), rain[scan.valid])]
        np.testing.assert_array_equal(prior.rain, PositionPrior.learn(valid).rain, err_msg=name)
        assert rule == IntensityRule.best(valid), name


def random_scan(seed: int, points: int, levels: int = 1000) -> tuple[Scan, Bools]:
    """Points of so many different ranges and intensities, and their rain: more of the near."""
    generator = np.random.default_rng(seed)
    columns = np.zeros((points, 4))
    columns[:, 0] = generator.integers(1, levels + 1, points) * 0.7
    columns[:, 3] = generator.integers(0, levels, points) * 0.1
    share = 0.8 - 0.7 * columns[:, 0] / columns[:, 0].max()
    return Scan.of(columns), generator.random(points) < share


@given(st.integers(0, 2**32), st.integers(1, 30), st.integers(1, 3), st.sampled_from([6, 1000]))
def test_no_other_rule_is_better_than_the_best(seed, points, scans, levels) -> None:
    truth = [random_scan(seed + number, points, levels) for number in range(scans)]
    whole = Scan.of(np.concatenate([np.c_[scan.xyz, scan.intensity] for scan, _ in truth]))
    rain = np.concatenate([rain for _, rain in truth])
    dim, near = (column <= column[:, None] for column in (whole.intensity, whole.range))
    found = IntensityRule.best(truth)(whole)
    if rain.any():
        assert iou(found, rain) == max(iou(rule, rain) for row in dim for rule in row & near)
    else:
        assert not found.any()


def test_a_scan_without_intensity_has_no_dim_points_and_teaches_nothing() -> None:
    bare = Scan(np.ones((4, 3), np.float32))
    assert not IntensityRule(intensity=np.inf, range=np.inf)(bare).any()
    taught = random_scan(seed=2, points=60)
    untaught = (bare, np.ones(4, bool))
    assert IntensityRule.best([untaught, taught]) == IntensityRule.best([taught])
    assert not IntensityRule.best([untaught])(taught[0]).any()


def test_on_real_snow_the_rule_reaches_its_published_quality(shared) -> None:
    points = np.fromfile(shared / "data/wads/sample.bin", np.float32).reshape(-1, 4)
    snow = np.fromfile(shared / "data/wads/sample.label", np.uint32) & 0xFFFF == 110
    scan = Scan.of(points)
    stated = iou(IntensityRule(intensity=0, range=20)(scan), snow)
    assert stated == pytest.approx(0.72, abs=0.005)
    assert iou(IntensityRule.best([(scan, snow)])(scan), snow) > stated
