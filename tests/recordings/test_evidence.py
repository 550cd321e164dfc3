"""What speaks for rain: rays by closed forms and brute force, surroundings, and votes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from derain.evaluation.hard_cases import hard_cases
from derain.recordings.evidence import (
    ENDS_AT,
    HALF_WEIGHT_AT,
    LARGEST_LOG_ODDS,
    LEAST_WEIGHT,
    RAYS,
    WENT_THROUGH,
    WITHIN,
    WITHIN_STEPS,
    RayEvidence,
    combined_log_odds,
    ray_evidence,
    ray_log_odds,
    surroundings_features,
    vote,
)
from derain.recordings.known_points import ScanPoints, range_of
from derain.scan import Scan

# A quarter of a degree, as far as the rays of many sensors lie apart.
STEP = np.radians(0.25)


def wall(distance: float, rows: int = 24, columns: int = 40) -> NDArray[np.float64]:
    """Points of a wall across x, seen by evenly spaced rays, (rows * columns, 3)."""
    inclination, azimuth = np.meshgrid(
        (np.arange(rows) - rows / 2 + 0.5) * STEP, (np.arange(columns) - columns / 2) * STEP
    )
    y, z = np.tan(azimuth.ravel()), np.tan(inclination.ravel()) / np.cos(azimuth.ravel())
    return distance * np.stack([np.ones_like(y), y, z], axis=1)


def points_of(xyz: NDArray[np.float64]) -> ScanPoints:
    return ScanPoints.of(Scan.of(xyz), threads=1)


def moved(x: float, yaw: float = 0.0) -> NDArray[np.float64]:
    motion = np.eye(4)
    motion[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    motion[0, 3] = x
    return motion


def test_rays_end_at_a_wall_and_go_through_a_drop_before_it() -> None:
    drop = np.array([[6.0, 0.03, 0.02]])
    points, other = points_of(np.concatenate([wall(20), drop])), points_of(wall(20))
    evidence = ray_evidence(points, other, np.eye(4))
    of_drop = np.abs(points.xyz[:, 0] - 6) < 0.1
    assert evidence.ending[of_drop] == 0
    assert evidence.through[of_drop] == pytest.approx(1)
    assert evidence.ending[~of_drop] == pytest.approx(1)
    assert (evidence.through[~of_drop] == 0).all()


def test_a_sensor_that_moved_sees_the_same() -> None:
    motion = moved(1.3, 0.02)
    drop = np.array([[6.0, 0.03, 0.02]])
    before = wall(20)
    after = (np.concatenate([before, drop]) - motion[:3, 3]) @ motion[:3, :3]
    evidence = ray_evidence(points_of(after), points_of(before), motion)
    middle = np.abs(after[:, 1]) < 1
    of_drop = np.argmin(np.abs(points_of(after).xyz[:, 0] - after[-1, 0]))
    assert evidence.through[of_drop] == pytest.approx(1)
    assert np.median(evidence.ending[middle]) == pytest.approx(1)


def test_a_ray_that_comes_back_tells_more_than_those_around_it() -> None:
    twig = wall(10)[[500]] * 0.6
    points = points_of(np.concatenate([wall(10), twig]))
    again = np.delete(wall(10), 500, axis=0)  # the ray to the twig ends there, not at the wall
    evidence = ray_evidence(points, points_of(np.concatenate([again, twig])), np.eye(4))
    of_twig = np.argmin(np.linalg.norm(points.xyz - twig, axis=1))
    assert evidence.ending[of_twig] > 0.4 > 1 / RAYS


def test_what_stands_before_a_place_says_nothing_of_it() -> None:
    points, other = points_of(wall(20)), points_of(wall(10))
    evidence = ray_evidence(points, other, np.eye(4))
    assert not evidence.ending.any()
    assert not evidence.through.any()


def test_where_there_are_no_rays_nothing_is_said() -> None:
    points = points_of(wall(20))
    for other in (points_of(-wall(20)), points_of(np.zeros((0, 3))), points_of(wall(20)[:3])):
        evidence = ray_evidence(points, other, np.eye(4))
        assert not evidence.through.any()
        assert evidence.ending.shape == (len(points),)
    nobody = ray_evidence(points_of(np.zeros((0, 3))), points, np.eye(4))
    assert nobody.ending.shape == (0,)


@given(st.integers(0, 2**32 - 1))
def test_it_is_what_asking_every_ray_says(seed: int) -> None:
    generator = np.random.default_rng(seed)
    clouds = [
        wall(generator.uniform(5, 30), 6, 8) * generator.uniform(0.97, 1.03, (48, 1))
        for _ in range(2)
    ]
    points, other = (points_of(cloud) for cloud in clouds)
    motion = moved(*generator.uniform(-0.05, 0.05, 2))
    evidence = ray_evidence(points, other, motion)
    within = max(np.radians(WITHIN), WITHIN_STEPS * points.step)
    for number, place in enumerate(points.xyz @ motion[:3, :3].T + motion[:3, 3]):
        reach = np.linalg.norm(place)
        ends = np.linalg.norm(other.xyz, axis=1)
        chords = np.linalg.norm(other.xyz / ends[:, None] - place / reach, axis=1)
        near = np.argsort(chords, kind="stable")[:RAYS]
        near = near[chords[near] <= within]
        heard = 1 / (1 + (chords[near] / np.radians(HALF_WEIGHT_AT)) ** 2)
        total = max(heard.sum(), LEAST_WEIGHT)
        behind = ends[near] - reach
        at, through = (offset + slope * reach for offset, slope in (ENDS_AT, WENT_THROUGH))
        ending = heard[np.abs(behind) <= at].sum() / total
        assert evidence.ending[number] == pytest.approx(ending)
        assert evidence.through[number] == pytest.approx(heard[behind > through].sum() / total)


def test_the_step_is_that_of_the_rays() -> None:
    # The third nearest ray of a grid is one step away, as the first, second and fourth are.
    assert points_of(wall(20, 30, 60)).step == pytest.approx(STEP, rel=0.05)
    assert points_of(wall(20)[:2]).step == 0.0


def test_a_range_is_never_nothing() -> None:
    assert (range_of(np.zeros((2, 3))) > 0).all()


def test_lonely_points_in_the_air_look_like_rain_and_walls_do_not() -> None:
    generator = np.random.default_rng(0)
    drops = generator.uniform((3, -4, -1), (8, 4, 1), (60, 3))
    points = points_of(np.concatenate([wall(20, 60, 160), drops]))
    log_odds = combined_log_odds(points, None)  # no other scan: the surroundings decide
    of_drops = points.xyz[:, 0] < 19
    assert (log_odds[of_drops] > 0).mean() > 0.9
    assert (log_odds[~of_drops] < 0).mean() > 0.99


def test_rays_that_end_speak_against_rain_and_those_that_go_through_for_it() -> None:
    shares = np.array([0.0, 0.5, 1.0])
    nothing = np.zeros(3)
    assert (np.diff(ray_log_odds(RayEvidence(shares, nothing))) < 0).all()
    assert (np.diff(ray_log_odds(RayEvidence(nothing, shares))) > 0).all()


def test_what_describes_a_point_is_the_same_at_any_step_of_the_sensor() -> None:
    # Twice as fine a sensor at half the distance sees the same places apart.
    coarse, fine = (surroundings_features(points_of(wall(d, 20, 30))) for d in (20.0, 10.0))
    assert coarse[:, 1:3] == pytest.approx(fine[:, 1:3], abs=0.02)
    assert (coarse[:, 3] - fine[:, 3]) == pytest.approx(np.log(2))


def test_a_vote_is_the_weighted_sum_of_clipped_voices() -> None:
    points = points_of(wall(20, 5, 7))
    log_odds = np.random.default_rng(1).normal(0, 5, len(points))
    for number, total in enumerate(vote(points, log_odds)):
        near = points.neighbours[number]
        far = points.distances[number] / (0.1 + 0.01 * points.range[number])
        voices = np.clip(log_odds[near], -LARGEST_LOG_ODDS, LARGEST_LOG_ODDS)
        assert total == pytest.approx((voices / (1 + far**2)).sum())


@pytest.mark.parametrize(("name", "scan"), list(hard_cases(2000)))
def test_hard_cases_have_finite_evidence(name: str, scan: Scan) -> None:
    points = ScanPoints.of(scan, threads=1)
    evidence = ray_evidence(points, points, np.eye(4))
    assert np.isfinite(vote(points, combined_log_odds(points, evidence))).all()
    assert np.isfinite(vote(points, combined_log_odds(points, None))).all()
