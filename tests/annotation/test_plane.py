"""The road's plane is found among rain and things, and is the same again."""

import numpy as np
import pytest
from numpy.typing import NDArray

from derain.annotation.plane import MOST_POINTS, Plane, PlaneSearch, find_plane
from derain.errors import InputError
from derain.system.open3d_import import import_open3d


def road(points: int, slope: tuple[float, float] = (0.03, -0.02)) -> NDArray[np.float64]:
    """A sloping road 1.3 m under the sensor, measured to a centimetre."""
    generator = np.random.default_rng(0)
    x, y = generator.uniform(2, 60, points), generator.uniform(-4, 4, points)
    z = slope[0] * x + slope[1] * y - 1.3 + generator.normal(0, 0.01, points)
    return np.column_stack([x, y, z])


def rain(points: int) -> NDArray[np.float64]:
    return np.random.default_rng(1).uniform((2, -4, -1.2), (20, 4, 3), (points, 3))


@pytest.fixture(autouse=True)
def _open3d() -> None:
    import_open3d()


def test_a_sloping_road_is_found_through_rain() -> None:
    plane = find_plane(np.concatenate([rain(2000), road(3000)]), PlaneSearch(), "test")
    expected = np.array([-0.03, 0.02, 1]) / np.linalg.norm([-0.03, 0.02, 1])
    np.testing.assert_allclose(plane.normal, expected, atol=1e-3)
    assert plane.offset == pytest.approx(1.3 * expected[2], abs=0.01)
    assert plane.slope == pytest.approx(np.degrees(np.arctan(np.hypot(0.03, 0.02))), abs=0.05)
    assert np.abs(plane.height(road(3000))).max() < 0.06


def test_heights_are_distances_and_positive_above() -> None:
    plane = Plane((0.0, 0.6, 0.8), 2.0)
    points = np.array([[5, 0, 0], [0, -1.2, -1.6], [7, 0, -2.5], [0, 0, -5]], float)
    np.testing.assert_allclose(plane.height(points), [2, 0, 0, -2], atol=1e-12)


def test_the_same_search_finds_the_same_plane() -> None:
    points = np.concatenate([road(MOST_POINTS), rain(1000)])  # more than are looked at
    first, again, other = (
        find_plane(points, PlaneSearch(iterations=100, seed=seed), "test") for seed in (0, 0, 1)
    )
    assert first == again != other


def test_the_normal_points_up_whatever_the_order_of_the_points() -> None:
    for seed in range(5):
        points = np.random.default_rng(seed).permutation(road(100))
        assert find_plane(points, PlaneSearch(), "test").normal[2] > 0.9


def test_a_wall_and_too_few_points_are_no_road() -> None:
    wall = road(500)[:, [2, 1, 0]]
    with pytest.raises(InputError, match=r"scan: .* 8[0-9] degrees"):
        find_plane(wall, PlaneSearch(), "scan")
    assert find_plane(road(9), PlaneSearch(), "scan").normal[2] > 0.9
    with pytest.raises(InputError, match="8 points over the road are too few"):
        find_plane(road(8), PlaneSearch(), "scan")
