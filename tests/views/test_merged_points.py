"""Merged points: copies of a return along its ray are one point, all else stays."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derain.scan import Floats, Ints
from derain.simulation.sensor import unit_vectors
from derain.views.merged_points import RANGE_RESOLUTION, SAME_RAY, are_one_return, merged_points
from derain.views.neighbour_search import NeighbourSearch

# Directions of a coarse sensor's rays, float64 (M, 3).
RAYS = unit_vectors(np.arange(0, 360, 6), np.linspace(-20, 5, 8)[:, None])


def merged(xyz: Floats) -> tuple[Ints, Ints]:
    points = xyz.astype(np.float32)
    neighbours, distances = NeighbourSearch(points)(9)
    return merged_points(points, np.arange(len(points)), neighbours, distances)


@given(st.floats(1, 100), st.floats(1e-6, 0.9 * RANGE_RESOLUTION), st.integers(0, 2**32 - 1))
def test_copies_along_the_ray_are_one_with_what_they_copy(range_, behind, seed) -> None:
    points = range_ * RAYS
    copies = (range_ + behind) * RAYS
    order = np.random.default_rng(seed).permutation(2 * len(points))
    kept, point = merged(np.concatenate([points, copies])[order])
    assert len(kept) == len(points)
    number = order % len(points)
    np.testing.assert_array_equal(number[kept][point], number)
    _, lowest = np.unique(number, return_index=True)
    np.testing.assert_array_equal(kept, np.sort(lowest))


@pytest.mark.parametrize("apart", [1.2 * RANGE_RESOLUTION, 0.5])
def test_a_second_return_farther_behind_stays(apart) -> None:
    kept, point = merged(np.concatenate([10 * RAYS, (10 + apart) * RAYS]))
    assert len(kept) == len(point) == 2 * len(RAYS)


def test_neighbouring_rays_stay_apart() -> None:
    azimuth = np.arange(200) * 2 * SAME_RAY
    arc = 5 * np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros(200)], axis=1)
    assert len(merged(arc)[0]) == 200


def test_of_some_points_it_is_found_which_neighbours_are_one_return_with_them() -> None:
    xyz = np.concatenate([10 * RAYS, 10.01 * RAYS]).astype(np.float32)
    some = np.array([3, 17])
    neighbours, distances = NeighbourSearch(xyz)(4, some)
    one = are_one_return(xyz, some, neighbours, distances)
    np.testing.assert_array_equal(one, neighbours[:, 1:] == some[:, None] + len(RAYS))
