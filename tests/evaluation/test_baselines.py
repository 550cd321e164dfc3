"""The baselines: places alone against a search through all choices of voxels."""

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from derain.errors import InputError
from derain.evaluation.baselines import PositionPrior, all_points, no_points
from derain.evaluation.counts import Counts
from derain.evaluation.hard_cases import hard_cases, scene
from derain.scan import Scan

HARD_CASES = dict(hard_cases(largest=5000))

Truth = tuple[Scan, NDArray[np.bool_]]


def iou(predicted: NDArray[np.bool_], rain: NDArray[np.bool_]) -> float:
    return Counts.of(predicted, rain).iou


def in_voxels(voxels: list[int], rain: list[bool]) -> Truth:
    """Points in the middle of voxels of half a metre along x."""
    x = np.asarray(voxels) / 2 + 0.25
    return Scan.of(np.stack([x, x * 0, x * 0 + 1], axis=1)), np.asarray(rain, bool)


@st.composite
def truths(draw: st.DrawFn) -> list[Truth]:
    """Scans of few voxels, with some rain among them."""
    scans = draw(
        st.lists(
            st.lists(st.tuples(st.integers(-4, 4), st.booleans()), max_size=12),
            min_size=1,
            max_size=4,
        )
    )
    return [in_voxels([v for v, _ in points], [r for _, r in points]) for points in scans]


@given(truths())
@settings(deadline=None)
def test_no_other_choice_by_share_is_better_on_the_training_scans(scans: list[Truth]) -> None:
    x = np.concatenate([scan.xyz[:, 0] for scan, _ in scans])
    rain = np.concatenate([rain for _, rain in scans])
    predicted = np.concatenate([PositionPrior.learn(scans)(scan) for scan, _ in scans])
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


def test_with_as_many_points_everywhere_no_choice_of_voxels_at_all_is_better() -> None:
    rng = np.random.default_rng(1)
    scans = [in_voxels(list(range(8)), list(rng.random(8) < 0.4)) for _ in range(5)]
    rain = np.concatenate([rain for _, rain in scans])
    voxel = np.tile(np.arange(8), 5)
    predicted = np.concatenate([PositionPrior.learn(scans)(scan) for scan, _ in scans])
    choices = [choice for size in range(9) for choice in combinations(range(8), size)]
    assert iou(predicted, rain) == max(iou(np.isin(voxel, choice), rain) for choice in choices)


def test_a_few_points_prove_less_than_many() -> None:
    # Calling the first voxel rain as well would be better only if its one point proved it.
    many = in_voxels([1] * 50 + [2] * 50, [True] * 45 + [False] * 5 + [False] * 50)
    one = in_voxels([0], [True])
    prior = PositionPrior.learn([many, one])
    assert prior(in_voxels([1, 0, 2], [False] * 3)[0]).tolist() == [True, True, False]
    rival = in_voxels([0] + [3] * 9, [True] + [False] * 9)
    assert PositionPrior.learn([many, rival])(in_voxels([3], [False])[0]).tolist() == [False]


def test_places_that_no_training_scan_has_seen_are_not_rain() -> None:
    prior = PositionPrior.learn([in_voxels([1, 2], [True, True])])
    assert prior(in_voxels([1, 3, 10**9], [False] * 3)[0]).tolist() == [True, False, False]


def test_voxels_end_at_their_edges_on_either_side_of_the_sensor() -> None:
    points = np.array([[-0.01, 0, 5], [0.01, 0, 5], [-0.99, 0.5, 5.9], [-1.01, 0, 5]], np.float32)
    prior = PositionPrior.learn([(Scan.of(points[:1]), np.ones(1, bool))], voxel=1.0)
    assert prior(Scan.of(points)).tolist() == [True, False, True, False]


def test_the_order_of_the_training_scans_does_not_matter() -> None:
    rng = np.random.default_rng(2)
    scans = [(Scan.of(scene(500, seed)), rng.random(500) < 0.3) for seed in range(4)]
    forward, backward = PositionPrior.learn(scans), PositionPrior.learn(scans[::-1])
    np.testing.assert_array_equal(forward.rain, backward.rain)
    assert len(forward.rain) > 0


@pytest.mark.parametrize("scan", HARD_CASES.values(), ids=HARD_CASES)
def test_hard_scans_get_an_answer_and_points_that_cannot_be_judged_teach_nothing(
    scan: Scan,
) -> None:
    rain = np.random.default_rng(0).random(len(scan)) < 0.5
    prior = PositionPrior.learn([(scan, rain)])
    for predicted in (prior(scan), all_points(scan), no_points(scan)):
        assert predicted.shape == (len(scan),)
        assert predicted.dtype == bool
        assert not predicted[~scan.valid].any()
    whole = PositionPrior.learn([(scan.take(scan.valid), rain[scan.valid])])
    np.testing.assert_array_equal(prior.rain, whole.rain)


def test_everything_and_nothing_are_what_they_say() -> None:
    scan = HARD_CASES["NaN and infinite rows"]
    np.testing.assert_array_equal(all_points(scan), scan.valid)
    assert not no_points(scan).any()


@pytest.mark.parametrize("voxel", [0.0, -0.5, float("nan"), float("inf")])
def test_voxels_without_an_extent_are_refused(voxel: float) -> None:
    with pytest.raises(InputError, match=r"voxel: .*above 0"):
        PositionPrior.learn([in_voxels([1], [True])], voxel)


def test_on_real_snow_places_do_well_in_their_sequence_and_worse_elsewhere(shared: Path) -> None:
    data = shared / "data/wads"
    labels = sorted((data / "sequences/36/labels").glob("*.label"))

    def read(scan: Path, label: Path) -> Truth:
        snow = np.fromfile(label, np.uint32) & 0xFFFF == 110
        return Scan.of(np.fromfile(scan, np.float32).reshape(-1, 4)), snow

    *train, (scan, snow) = [
        read(data / f"sequences/36/velodyne/{label.stem}.bin", label) for label in labels[:3]
    ]
    prior = PositionPrior.learn(train)
    elsewhere, other_snow = read(data / "sample.bin", data / "sample.label")
    assert iou(prior(elsewhere), other_snow) < 0.5 < iou(prior(scan), snow)
