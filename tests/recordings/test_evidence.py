"""What speaks for rain: rays of other scans, surroundings, and votes."""

import numpy as np
import pytest

from derain.recordings.evidence import (
    LARGEST_LOG_ODDS,
    PRIOR,
    RAY_WEIGHTS,
    ScanPoints,
    combined_log_odds,
    surroundings_features,
    surroundings_log_odds,
    vote,
)
from derain.recordings.rays import RayEvidence
from derain.scan import Floats, Scan

from .test_rays import STEP, wall


def points_of(xyz: Floats) -> ScanPoints:
    return ScanPoints(Scan.of(xyz), threads=1)


def test_the_step_is_that_of_the_rays() -> None:
    # The third nearest ray of a grid is one step away, as the first, second and fourth are.
    assert points_of(wall(20, 30, 60)).rays.step == pytest.approx(STEP, rel=0.05)
    assert points_of(wall(20)[:2]).rays.step == 0.0


def test_lonely_points_in_the_air_look_like_rain_and_walls_do_not() -> None:
    generator = np.random.default_rng(0)
    drops = generator.uniform((3, -4, -1), (8, 4, 1), (60, 3))
    points = points_of(np.concatenate([wall(20, 60, 160), drops]))
    log_odds = surroundings_log_odds(points)  # no other scan: the surroundings decide
    of_drops = points.xyz[:, 0] < 19
    assert (log_odds[of_drops] > 0).mean() > 0.9
    assert (log_odds[~of_drops] < 0).mean() > 0.99


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
        far = points.distances[number] / (0.1 + 0.01 * points.rays.range[number])
        voices = np.clip(log_odds[near], -LARGEST_LOG_ODDS, LARGEST_LOG_ODDS)
        assert total == pytest.approx((voices / (1 + far**2)).sum())


def test_rays_that_are_as_those_of_any_point_change_nothing() -> None:
    points = points_of(wall(20, 5, 7))
    any_point, ending, _ = RAY_WEIGHTS
    share = np.full(len(points), (PRIOR - any_point) / ending)
    usual = RayEvidence(share, np.zeros(len(points)))
    alone = surroundings_log_odds(points)
    assert combined_log_odds(alone, usual) == pytest.approx(alone)
