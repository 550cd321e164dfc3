"""What rays of another scan show of places: closed forms, and brute force."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derain.recordings.rays import (
    ENDS_AT,
    HALF_WEIGHT_AT,
    LEAST_WEIGHT,
    RAYS,
    WENT_THROUGH,
    WITHIN,
    WITHIN_STEPS,
    Rays,
    ray_evidence,
)
from derain.scan import Floats

from .street import motion

# A quarter of a degree, as far as the rays of many sensors lie apart.
STEP = np.radians(0.25)


def wall(distance: float, rows: int = 24, columns: int = 40) -> Floats:
    """Points of a wall across x, seen by evenly spaced rays, (rows * columns, 3)."""
    inclination, azimuth = np.meshgrid(
        (np.arange(rows) - rows / 2 + 0.5) * STEP, (np.arange(columns) - columns / 2) * STEP
    )
    y, z = np.tan(azimuth.ravel()), np.tan(inclination.ravel()) / np.cos(azimuth.ravel())
    return distance * np.stack([np.ones_like(y), y, z], axis=1)


def test_rays_end_at_a_wall_and_go_through_a_drop_before_it() -> None:
    drop = np.array([[6.0, 0.03, 0.02]])
    places = np.concatenate([wall(20), drop])
    evidence = ray_evidence(places, Rays(wall(20), 1), STEP)
    of_drop = np.abs(places[:, 0] - 6) < 0.1
    assert evidence.ending[of_drop] == 0
    assert evidence.through[of_drop] == pytest.approx(1)
    assert evidence.ending[~of_drop] == pytest.approx(1)
    assert (evidence.through[~of_drop] == 0).all()


def test_where_there_are_no_rays_nothing_is_known() -> None:
    places = wall(20)
    for other in (-wall(20), np.zeros((0, 3)), wall(20)[:3]):
        evidence = ray_evidence(places, Rays(other, 1), STEP)
        assert not evidence.through.any()
        assert evidence.ending.shape == (len(places),)
    nobody = ray_evidence(places[:0], Rays(places, 1), STEP)
    assert nobody.ending.shape == (0,)


@given(st.integers(0, 2**32 - 1))
def test_it_is_what_a_search_of_every_ray_finds(seed) -> None:
    generator = np.random.default_rng(seed)
    clouds = [
        wall(generator.uniform(5, 30), 6, 8) * generator.uniform(0.97, 1.03, (48, 1))
        for _ in range(2)
    ]
    moved, other = motion(generator.uniform(-0.05, 0.05), yaw=generator.uniform(-3, 3)), clouds[1]
    places = clouds[0] @ moved[:3, :3].T + moved[:3, 3]
    evidence = ray_evidence(places, Rays(other, 1), STEP)
    within = max(np.radians(WITHIN), WITHIN_STEPS * STEP)
    for number, place in enumerate(places):
        reach = np.linalg.norm(place)
        ends = np.linalg.norm(other, axis=1)
        chords = np.linalg.norm(other / ends[:, None] - place / reach, axis=1)
        near = np.argsort(chords, kind="stable")[:RAYS]
        near = near[chords[near] <= within]
        heard = 1 / (1 + (chords[near] / np.radians(HALF_WEIGHT_AT)) ** 2)
        total = max(heard.sum(), LEAST_WEIGHT)
        behind = ends[near] - reach
        at, through = (offset + slope * reach for offset, slope in (ENDS_AT, WENT_THROUGH))
        ending = heard[np.abs(behind) <= at].sum() / total
        assert evidence.ending[number] == pytest.approx(ending)
        assert evidence.through[number] == pytest.approx(heard[behind > through].sum() / total)


def test_a_ray_that_ends_at_a_drop_shows_nothing_solid() -> None:
    places, rays = wall(20), Rays(wall(20), 1)
    solid = np.ones(len(rays))
    known = ray_evidence(places, rays, STEP)
    np.testing.assert_array_equal(ray_evidence(places, rays, STEP, solid).ending, known.ending)
    np.testing.assert_allclose(ray_evidence(places, rays, STEP, solid / 4).ending, known.ending / 4)
    solid[::2] = 0
    some = ray_evidence(places, rays, STEP, solid).ending
    assert 0 < some.mean() < known.ending.mean()
