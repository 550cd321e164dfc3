"""The plane of the road, in scenes of which it is known."""

import numpy as np
import pytest

from derain.filters.ground import find_ground
from derain.scan import Floats


def road(slope_x: float, slope_y: float, offset: float, generator: np.random.Generator) -> Floats:
    """Rings of returns from a plane, as a spinning sensor sees it, float64 (6000, 3)."""
    reach, azimuth = np.meshgrid(np.geomspace(2, 29, 30), np.linspace(0, 2 * np.pi, 200))
    x, y = (reach * np.cos(azimuth)).ravel(), (reach * np.sin(azimuth)).ravel()
    z = slope_x * x + slope_y * y + offset + generator.normal(0, 0.01, x.size)
    return np.stack([x, y, z], axis=1)


def clutter(generator: np.random.Generator) -> Floats:
    """A wall, drops all around, and echoes from beneath the road, float64 (3200, 3)."""
    wall = np.stack(
        [np.full(2000, 15.0), generator.uniform(-20, 20, 2000), generator.uniform(-2, 6, 2000)],
        axis=1,
    )
    drops = generator.uniform([-12, -12, -1.5], [12, 12, 5], (1000, 3))
    echoes = generator.uniform([-20, -20, -5], [20, 20, -2.5], (200, 3))
    return np.concatenate([wall, drops, echoes])


@pytest.mark.parametrize(
    ("slope_x", "slope_y"), [(0, 0), (0.03, -0.02), (0.09, 0.04), (-0.2, 0.1), (0.0, 0.4)]
)
@pytest.mark.parametrize("offset", [-0.6, -1.8, -3.5])
def test_the_plane_of_a_road_is_found_whatever_stands_on_it(slope_x, slope_y, offset) -> None:
    generator, up = np.random.default_rng(0), np.array([0, 0, 1])
    plane = road(slope_x, slope_y, offset, generator)
    scene = np.concatenate([plane, clutter(generator) + up * (offset + 1.8)])
    ground = find_ground(generator.permutation(scene))
    np.testing.assert_allclose(
        [ground.slope_x, ground.slope_y, ground.offset], [slope_x, slope_y, offset], atol=0.03
    )
    assert not ground.is_above(plane).any()
    assert ground.is_above(plane + 0.4 * up).all()


def test_a_plane_alone_is_found_exactly() -> None:
    x, y = (axis.ravel().astype(np.float64) for axis in np.mgrid[-20:21, -20:21])
    ground = find_ground(np.stack([x, y, 0.05 * x - 0.1 * y - 2], axis=1))
    found = (ground.slope_x, ground.slope_y, ground.offset)
    np.testing.assert_allclose(found, (0.05, -0.1, -2), atol=1e-9)


def test_where_there_is_no_road_none_is_found() -> None:
    generator = np.random.default_rng(1)
    ceiling = road(0, 0, 2.5, generator)
    wall = generator.uniform([10, -20, -5], [10.01, 20, 9], (5000, 3))
    haze = generator.uniform(-20, 20, (5000, 3))
    steep = road(0.9, 0, -1.8, generator)
    for scene in (ceiling, wall, haze, steep, haze[:20], haze[:0]):
        assert find_ground(scene) is None
