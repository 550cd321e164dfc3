"""Augmentation turns, jitters, mirrors and thins a scan, and changes nothing else about it."""

import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derain.datamodules.augmentation import Augmentation
from derain.errors import InputError
from derain.evaluation.hard_cases import hard_cases, scene
from derain.scan import Scan

HARD_CASES = dict(hard_cases(largest=5000))
TURN = Augmentation(rotation_probability=1, jitter_probability=0)
MIRROR = Augmentation(0, 0, mirror_probability=1)
DROP = Augmentation(0, 0, dropping_probability=1)
BOTH = Augmentation(rotation_probability=1, jitter_probability=1)
CERTAINTY = st.sampled_from([0, 1])


def street() -> Scan:
    return Scan.of(scene(2000)).with_label(np.arange(2000))


@given(st.integers(0, 2**32))
def test_a_turn_is_about_the_vertical_axis_and_the_same_for_all_points(seed) -> None:
    scan = street()
    turned = TURN(scan, np.random.default_rng(seed))
    before, after = (s.xyz[:, 0] + 1j * s.xyz[:, 1] for s in (scan, turned))
    np.testing.assert_array_equal(turned.xyz[:, 2], scan.xyz[:, 2])
    np.testing.assert_allclose(np.abs(after), np.abs(before), rtol=1e-5)
    np.testing.assert_allclose(after / before, (after / before)[0], atol=1e-5)


def test_jitter_is_in_metres_and_the_same_in_every_direction() -> None:
    scan = Scan.of(scene(20_000))
    moved = Augmentation(0, 1, jitter=0.05)(scan, np.random.default_rng(0)).xyz - scan.xyz
    np.testing.assert_allclose(moved.std(axis=0), 0.05, rtol=0.05)
    np.testing.assert_allclose(moved.mean(axis=0), 0, atol=0.002)


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_each_happens_to_its_share_of_scans(share) -> None:
    scan = Scan.of(scene(300))
    rng = np.random.default_rng(0)
    mirror = Augmentation(0, 0, mirror_probability=share)
    drop = Augmentation(0, 0, dropping_probability=share)
    for augmentation in (Augmentation(share, 0), Augmentation(0, share), mirror, drop):
        changed = [not np.array_equal(augmentation(scan, rng).xyz, scan.xyz) for _ in range(400)]
        assert np.mean(changed) == pytest.approx(share, abs=0.1 if share == 0.5 else 0.01)


def test_a_mirror_changes_left_and_right_and_nothing_else() -> None:
    scan = street()
    mirrored = MIRROR(scan, np.random.default_rng(0))
    np.testing.assert_array_equal(mirrored.xyz, scan.xyz * [1, -1, 1])
    np.testing.assert_array_equal(mirrored.intensity, scan.intensity)
    np.testing.assert_array_equal(mirrored.label, scan.label)


@given(st.integers(0, 2**32))
def test_points_that_are_left_keep_their_order_and_what_belongs_to_them(seed) -> None:
    scan = street()
    left = DROP(scan, np.random.default_rng(seed))
    assert (np.diff(left.label) > 0).all()  # a point's label is its row
    np.testing.assert_array_equal(left.xyz, scan.xyz[left.label])
    np.testing.assert_array_equal(left.intensity, scan.intensity[left.label])


@pytest.mark.parametrize("dropping", [0.1, 0.5])
def test_a_scan_loses_any_share_of_its_points_up_to_the_largest(dropping) -> None:
    scan, rng = Scan.of(scene(5000)), np.random.default_rng(0)
    drop = Augmentation(0, 0, dropping_probability=1, dropping=dropping)
    lost = np.array([1 - len(drop(scan, rng)) / len(scan) for _ in range(300)])
    assert lost.max() <= dropping + 0.03
    assert lost.mean() == pytest.approx(dropping / 2, abs=0.02)
    assert lost.std() == pytest.approx(dropping / 12**0.5, abs=0.02)


@given(st.floats(-180, 180), st.floats(0, 350), st.integers(0, 2**32), CERTAINTY, CERTAINTY)
def test_what_is_seen_stays_where_a_network_looks_that_does_not_see_all_around(
    right, width, seed, turned, mirrored
) -> None:
    azimuth = np.radians(np.linspace(right, right + width, 50))
    points = np.stack([9 * np.cos(azimuth), 9 * np.sin(azimuth), azimuth * 0 + 1], axis=1)
    augmentation = Augmentation(turned, 0, mirror_probability=mirrored)
    seen = (right, right + width)
    changed = augmentation(Scan.of(points), np.random.default_rng(seed), seen)
    from_right = (np.degrees(np.arctan2(changed.xyz[:, 1], changed.xyz[:, 0])) - right) % 360
    assert (np.minimum(from_right, 360 - from_right) <= width + 1e-3).all()
    within = np.where(from_right > 359.9, 0, from_right)
    expected = np.linspace(0, width, 50)
    np.testing.assert_allclose(within, expected[::-1] if mirrored else expected, atol=1e-2)


@pytest.mark.parametrize("scan", HARD_CASES.values(), ids=HARD_CASES)
def test_points_that_cannot_be_judged_stay_as_they_are(scan) -> None:
    before = scan.xyz.copy()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        changed, mirrored, dropped = (
            each(scan, np.random.default_rng(0)) for each in (BOTH, MIRROR, DROP)
        )
    assert changed.xyz.dtype == np.float32
    np.testing.assert_array_equal(scan.xyz, before)
    np.testing.assert_array_equal(mirrored.valid, scan.valid)
    assert dropped.valid.sum() <= scan.valid.sum()
    np.testing.assert_array_equal(changed.valid, scan.valid)
    np.testing.assert_array_equal(changed.xyz[~scan.valid], scan.xyz[~scan.valid])
    np.testing.assert_array_equal(changed.intensity, scan.intensity)
    assert (changed.xyz[scan.valid] != scan.xyz[scan.valid]).any() or not scan.valid.any()


def test_other_intensities_are_alike_inverted_or_of_few_levels_and_all_else_stays() -> None:
    scan, seen = street(), set()
    change = Augmentation(0, 0, brightness_probability=1)
    for seed in range(12):
        changed = change(scan, np.random.default_rng(seed))
        np.testing.assert_array_equal(changed.xyz, scan.xyz)
        np.testing.assert_array_equal(changed.label, scan.label)
        order = np.argsort(scan.intensity)
        steps = np.diff(changed.intensity[order])
        if not steps.any():
            seen.add("alike")
        elif (steps <= 0).all():
            seen.add("inverted")
        else:
            assert (steps >= 0).all()
            assert len(np.unique(changed.intensity)) <= 7
            seen.add("few levels")
    assert seen == {"alike", "inverted", "few levels"}


def test_rain_alone_may_get_other_intensities() -> None:
    scan = street()
    rain = np.arange(0, 2000, 10)
    change, seen = Augmentation(0, 0, brightness_probability=1), set()
    for seed in range(20):
        changed = change(scan, np.random.default_rng(seed), rain=rain)
        rest = np.setdiff1d(np.arange(2000), rain)
        if np.array_equal(changed.intensity[rest], scan.intensity[rest]):
            ratio = np.median(changed.intensity[rain] / scan.intensity[rain])
            seen.add("brighter" if ratio > 1 else "darker")
    assert seen == {"brighter", "darker"}


@pytest.mark.parametrize(
    ("option", "value"),
    [("dropping", 2), ("mirror_probability", 1.5), ("jitter", -0.1)],
)
def test_numbers_that_no_scan_can_be_changed_by_are_refused(option, value) -> None:
    with pytest.raises(InputError, match=option):
        Augmentation(**{option: value})
