"""Odometry finds known motions, the same on any number of threads, and reports where it fails."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from derain.files import read_scan
from derain.recordings.odometry import (
    FEWEST_USUAL,
    LARGEST_CHANGE,
    LARGEST_TURN,
    LEAST_FACING,
    LEAST_MATCHED,
    MOST_APART,
    TIMES_THE_USUAL,
    WELL_ENOUGH,
    Odometry,
    Registration,
    Trust,
    shift_of,
    turn_of,
)
from derain.recordings.surfaces import Fit
from derain.scan import Scan

from .street import motion, scan_from

STEPS = [motion(1.3, 0.01, yaw=1.0), motion(1.32, 0.0, yaw=1.5), motion(1.35, 0.02, yaw=2.0)]
NOTHING = Scan.of(np.zeros((0, 3)))


def drive(steps: list[np.ndarray], first_seed: int = 0) -> tuple[list[Scan], list[np.ndarray]]:
    """Scans along a drive, and the poses that they were taken at."""
    poses = [np.eye(4)]
    for step in steps:
        poses.append(poses[-1] @ step)
    return [scan_from(pose, first_seed + place) for place, pose in enumerate(poses)], poses


@pytest.fixture(scope="module")
def driven() -> tuple[list[Scan], list[np.ndarray]]:
    return drive(STEPS)


def assert_is(found: np.ndarray, true: np.ndarray, metres: float, degrees: float) -> None:
    error = np.linalg.inv(true) @ found
    assert shift_of(error) < metres
    assert turn_of(error) < degrees


def test_known_motions_are_found_through_noise_and_drops(driven) -> None:
    scans, poses = driven
    odometry = Odometry()
    found = [odometry.register(scan) for scan in scans]
    assert all(each.trusted and not each.reason for each in found)
    assert_is(found[0].pose, np.eye(4), 1e-12, 1e-6)
    product = np.eye(4)
    for each, step, pose in zip(found[1:], STEPS, poses[1:], strict=True):
        product = product @ each.motion
        np.testing.assert_allclose(each.pose, product, atol=1e-12)
        assert_is(each.motion, step, 0.03, 0.1)
        assert_is(each.pose, pose, 0.05, 0.2)
        assert 0 < each.residual < 0.05
        assert each.matched > 0.7
        assert each.distance == pytest.approx(1.3, abs=0.1)


def test_threads_copies_and_what_came_before_change_no_bit(driven) -> None:
    scans = driven[0][:3]
    copies = [scan.take(np.repeat(np.arange(len(scan)), 2)) for scan in scans]
    empty_rows = np.full((5, 3), np.nan, np.float32)
    with_holes = [Scan.of(np.concatenate([empty_rows, scan.xyz])) for scan in scans]
    used = Odometry(1)
    used.register(scan_from(motion(30), 77))
    used.register(NOTHING)
    used.restart()
    reference = poses_of(Odometry(1), scans)
    np.testing.assert_array_equal(poses_of(Odometry(2), scans), reference)
    np.testing.assert_array_equal(poses_of(Odometry(1), copies), reference)
    np.testing.assert_array_equal(poses_of(Odometry(1), with_holes), reference)
    np.testing.assert_array_equal(poses_of(used, scans), reference)


def poses_of(odometry: Odometry, scans: list[Scan]) -> np.ndarray:
    return np.array([odometry.register(scan).pose for scan in scans])


def test_a_gap_is_reported_and_bridged_where_the_scans_still_meet(driven) -> None:
    # From 1.3 m a scan to 4 m: two scans are missing.
    scans, poses = drive([*STEPS, motion(3.9), motion(1.3)])
    odometry = Odometry()
    found = [odometry.register(scan) for scan in scans]
    assert [each.trusted for each in found] == [True, True, True, True, False, True]
    assert "out of order or far apart" in found[4].reason
    assert_is(found[5].pose, poses[5], 0.1, 0.3)


@pytest.mark.parametrize(
    ("other", "reason"),
    [
        (NOTHING, "has only 0 surfaces in reach"),
        (Scan.of(np.full((20, 3), 10.0)), "has only 1 surfaces in reach"),
    ],
)
def test_what_cannot_be_registered_is_reported_and_the_motion_goes_on(
    driven, other, reason
) -> None:
    scans, _ = driven
    odometry = Odometry()
    found = [odometry.register(scan) for scan in (scans[0], scans[1], other, scans[2], scans[3])]
    assert [each.trusted for each in found] == [True, True, False, False, True]
    assert reason in found[2].reason
    np.testing.assert_array_equal(found[2].motion, found[1].motion)
    np.testing.assert_array_equal(found[3].motion, found[1].motion)
    assert_is(found[4].motion, STEPS[2], 0.03, 0.1)


def test_a_first_scan_that_sees_nothing_is_reported_with_the_next() -> None:
    odometry = Odometry()
    first = odometry.register(NOTHING)
    second = odometry.register(scan_from(np.eye(4), 0))
    third = odometry.register(scan_from(motion(1), 1))
    assert (first.trusted, second.trusted, third.trusted) == (True, False, True)
    assert "the scan before has only 0 surfaces" in second.reason
    np.testing.assert_array_equal(second.motion, np.eye(4))
    assert np.isnan(second.residual)
    assert second.matched == 0


def test_a_bare_road_that_shows_no_way_along_it_is_not_trusted() -> None:
    odometry = Odometry()
    for seed in range(2):
        flat = np.random.default_rng(seed).uniform(-60, 60, (40_000, 2))
        seen = np.c_[flat, np.zeros(40_000)]
        found = odometry.register(scan_from(motion(1.3 * seed), seed, world=seen))
    assert not found.trusted
    assert "too few surfaces face some direction" in found.reason


@pytest.mark.parametrize("degrees", [0, 1e-9, 1e-3, 1, 90, 179.999, 180])
def test_a_turn_is_exact_to_the_last_digits(degrees) -> None:
    assert turn_of(motion(5, 5, yaw=degrees)) == pytest.approx(degrees, abs=1e-10)


def registered(folder: Path, number: int, every: int = 1) -> list[Registration]:
    odometry = Odometry()
    paths = sorted(folder.glob("*.bin"))[:number:every]
    return [odometry.register(read_scan(path)) for path in paths]


def test_snowykitti_stands(shared) -> None:
    found = registered(shared / "data/snowykitti/velodyne", 5)
    assert len(found) == 5
    assert all(each.trusted for each in found)
    assert max(each.distance for each in found) < 0.02
    assert max(each.turn for each in found) < 0.1


def test_the_wads_drive_goes_on_evenly(shared) -> None:
    folder = shared / "data/wads/drive/velodyne"
    found, skipping = registered(folder, 9), registered(folder, 9, every=2)
    assert len(found) == 9
    assert all(each.trusted for each in (*found, *skipping))
    assert all(1.2 < each.distance < 1.4 for each in found[1:])
    for place, each in enumerate(skipping[1:], 1):
        composed = found[2 * place - 1].motion @ found[2 * place].motion
        assert_is(composed, each.motion, 0.03, 0.1)


GOOD = Fit(np.eye(4), converged=True, residual=0.03, matched=0.9, facing=0.05)


@pytest.mark.parametrize(
    ("fault", "reason"),
    [
        ({"matched": LEAST_MATCHED - 0.01}, "only 49% of its surfaces"),
        ({"residual": MOST_APART + 0.001}, "its surfaces lie 0.131 m from those"),
        ({"facing": LEAST_FACING / 2}, "too few surfaces face some direction"),
        ({"converged": False}, "did not converge"),
    ],
)
def test_each_fault_is_named(fault, reason) -> None:
    assert reason in Trust().misfit(replace(GOOD, **fault))


def test_what_is_usual_is_learnt_from_trusted_scans_alone() -> None:
    trust = Trust()
    poor = replace(GOOD, residual=TIMES_THE_USUAL * GOOD.residual + 0.001)
    for _ in range(FEWEST_USUAL):
        trust.remember(poor, trusted=False)
        assert trust.misfit(poor) == ""
    for _ in range(FEWEST_USUAL):
        trust.remember(GOOD, trusted=True)
    assert "limit of 0.090 m" in trust.misfit(poor)
    assert trust.misfit(replace(GOOD, residual=0.089)) == ""
    for _ in range(10):  # a sensor that stands fits better, and may drive off
        trust.remember(replace(GOOD, residual=0.001), trusted=True)
    assert trust.misfit(replace(GOOD, residual=WELL_ENOUGH)) == ""
    assert trust.misfit(replace(GOOD, residual=WELL_ENOUGH + 0.01)) != ""


def test_a_motion_is_likely_where_it_is_near_the_last_or_the_last_trusted_one() -> None:
    trust = Trust()
    assert trust.unlikely(motion(5)) == ""  # nothing is known of the speed as yet
    assert "a turn by 25 degrees" in trust.unlikely(motion(yaw=LARGEST_TURN + 5))
    trust.remember(replace(GOOD, motion=motion(1.3)), trusted=True)
    assert trust.unlikely(motion(1.3 + 0.9 * LARGEST_CHANGE)) == ""
    assert trust.unlikely(motion(1.3, yaw=9)) == ""
    assert trust.unlikely(motion(1.3, yaw=15)) != ""
    jump = motion(1.3 + 2 * LARGEST_CHANGE)
    assert "1.0 m off the prediction" in trust.unlikely(jump)
    trust.remember(replace(GOOD, motion=jump), trusted=False)
    assert trust.unlikely(motion(1.4)) == ""
    assert trust.unlikely(jump) == ""
