"""Rays are counted once, where they first meet rain or else end, in any order of the rows."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derain.files import read_scan
from derain.scan import Bools, Ints, Scan
from derain.views.directions import directions
from derain.weather.rays import BIN, RANGE_BINS, RAY_SECTORS, ray_ends

# A return: number of its ray, range in metres, and whether it is rain.
Return = tuple[int, float, bool]

# Rays are degrees apart, none so near the border of a cell that rounding takes it to another.
returns_of_rays = st.lists(
    st.tuples(st.integers(0, 40), st.floats(0.5, 120), st.booleans()), max_size=120
)


def azimuth_of(ray: int) -> float:
    return 9.0 * ray + 0.005 - 180


def scan_of(returns: list[Return]) -> tuple[Scan, Bools]:
    """The scan of some returns, and what is rain of it."""
    azimuth = np.radians([azimuth_of(ray) for ray, _, _ in returns])
    inclination = np.radians([ray % 7 + 0.005 for ray, _, _ in returns])
    reach = np.array([reach for _, reach, _ in returns])
    across = np.cos(inclination)
    directions = np.stack(
        [across * np.cos(azimuth), across * np.sin(azimuth), np.sin(inclination)], axis=1
    )
    points = (directions * reach[:, None]).reshape(-1, 3).astype(np.float32)
    return Scan(points), np.array([rain for _, _, rain in returns], bool)


def counted_one_by_one(returns: list[Return]) -> Ints:
    """The same by going from ray to ray."""
    counts = np.zeros((2, RAY_SECTORS, RANGE_BINS), np.int64)
    for ray in {ray for ray, _, _ in returns}:
        own = [(reach, rain) for number, reach, rain in returns if number == ray]
        drops = [reach for reach, rain in own if rain]
        end = min(drops) if drops else max(reach for reach, _ in own)
        sector = round(azimuth_of(ray) % 360 / 30) % RAY_SECTORS
        counts[int(bool(drops)), sector, min(int(np.float32(end) / BIN), RANGE_BINS - 1)] += 1
    return counts


@given(returns_of_rays, st.integers(0, 2**32 - 1))
def test_a_ray_ends_at_its_first_drop_or_else_where_it_was_seen_last(returns, seed) -> None:
    # Of bins, where float32 is next to the border of one, either may be right.
    returns = [each for each in returns if 0.01 < each[1] % BIN < BIN - 0.01]
    scan, rain = scan_of(returns)
    expected = counted_one_by_one(returns)
    np.testing.assert_array_equal(ray_ends(scan, rain), expected)
    # Returns that are written twice count once, in any order of the rows.
    twice = np.random.default_rng(seed).permutation(np.repeat(np.arange(len(returns)), 2))
    np.testing.assert_array_equal(ray_ends(scan.take(twice), rain[twice]), expected)


def test_the_first_sector_is_ahead_and_the_next_ones_go_to_the_left() -> None:
    degrees = np.radians([0, 14.9, -14.9, 15.1, 90, 179, -179, -90, -15.1])
    points = np.stack([np.cos(degrees), np.sin(degrees), 0 * degrees], axis=1).astype(np.float32)
    sectors = [
        int(np.argwhere(ray_ends(Scan(point[None]), np.zeros(1, bool)))[0, 1]) for point in points
    ]
    assert sectors == [0, 0, 0, 1, 3, 6, 6, 9, 11]


def test_straight_behind_right_up_and_down_are_one_direction_each() -> None:
    behind = np.array([[-5, 0.0, 1], [-10, -0.0, 2], [-15, 0.0, 3]], np.float32)
    right = np.array([[1e-9, -5, 0], [-1e-9, -10, 0], [0, -15, 0]], np.float32)
    for points in (behind, right):
        assert ray_ends(Scan(points), np.zeros(3, bool)).sum() == 1
    points = np.array([[0, 0, 3], [-0.0, 0, 9], [0, 0, -2], [0, -0.0, -4]], np.float32)
    ends = ray_ends(Scan(points), np.zeros(4, bool))
    assert np.argwhere(ends.sum(axis=1)).tolist() == [[0, 8], [0, 18]]


def test_what_cannot_be_judged_and_what_a_radar_saw_is_of_no_ray() -> None:
    points = np.array([[5, 0, 0], [np.nan, 1, 1], [0, 0, 0], [-1, -1, -1], [0, 7, 0]], np.float32)
    scan = Scan(points, radar=np.array([False] * 4 + [True]))
    ends = ray_ends(scan, np.array([False, True, True, True, True]))
    assert np.argwhere(ends).tolist() == [[0, 0, 10]]


def test_of_real_scans_a_direction_is_a_ray(shared) -> None:
    # One of single returns, without its copies; one of two returns as the sensor wrote it.
    for scan_file in ("clean/kitti_front.bin", "wads/drive/velodyne/042223.bin"):
        scan = read_scan(shared / "data" / scan_file)
        seen = np.round(np.stack(directions(scan.xyz[scan.valid]), axis=1), 2)
        rays = ray_ends(scan, np.zeros(len(scan), bool)).sum()
        assert rays == pytest.approx(len(np.unique(seen, axis=0)), rel=0.01)
