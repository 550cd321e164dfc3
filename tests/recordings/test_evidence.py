"""What speaks for rain: rays of other scans, surroundings, and votes."""

import numpy as np
import pytest
from numpy.typing import NDArray

from derain.evaluation.hard_cases import hard_cases
from derain.recordings.evidence import (
    LARGEST_LOG_ODDS,
    ScanPoints,
    combined_log_odds,
    ray_log_odds,
    surroundings_features,
    vote,
)
from derain.recordings.rays import RayEvidence, ray_evidence
from derain.scan import Scan

from .test_rays import STEP, wall


def points_of(xyz: NDArray[np.float64]) -> ScanPoints:
    return ScanPoints.of(Scan.of(xyz), threads=1)


def test_the_step_is_that_of_the_rays() -> None:
    # The third nearest ray of a grid is one step away, as the first, second and fourth are.
    assert points_of(wall(20, 30, 60)).rays.step == pytest.approx(STEP, rel=0.05)
    assert points_of(wall(20)[:2]).rays.step == 0.0


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
    evidence = ray_evidence(points.xyz, points.rays, points.rays.step)
    assert np.isfinite(vote(points, combined_log_odds(points, evidence))).all()
    assert np.isfinite(vote(points, combined_log_odds(points, None))).all()
