"""Looked-up pixels against computed ones, above all for points on the borders between pixels."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from derain.scan import Float32s, Ints
from derain.simulation.sensor import unit_vectors
from derain.views.direction_table import BINS, BORDER_MARGIN, UNSURE_BELOW, height_of, turn_of
from derain.views.directions import directions
from derain.views.spherical_grid import PUBLISHED_GRIDS, SphericalGrid, grid_of

PUBLISHED = [grid_of(name, "test") for name in PUBLISHED_GRIDS]
GRIDS = [
    *PUBLISHED,
    SphericalGrid.even(256, 1152, (-13.5, 13.5), (-57.55, 57.55)),
    SphericalGrid.even(4, 8, (-90, 90), (140, 220)),  # backwards, from pole to pole
    SphericalGrid.even(3, 7, (-10, 10), (-123.4, 236.6)),  # a circle that begins anywhere
    SphericalGrid.even(2, 3, (-1e-3, 1e-3), (179.9999, 180.0001)),  # smaller than a bin
    SphericalGrid.even(1, 300_000, (-5, 5)),  # columns narrower than a bin
]


def computed(grid: SphericalGrid, xyz: Float32s) -> Ints:
    """Pixels by the trigonometry of every point in float64; -1 outside."""
    azimuth, inclination = directions(xyz)
    ascending = np.array(grid.edges[::-1])
    row = np.minimum(grid.rows - np.searchsorted(ascending, inclination), grid.rows - 1)
    right, left = grid.azimuth
    from_left = (left - azimuth) % 360
    column = (from_left * grid.columns / (left - right)).astype(np.int64)
    inside = (inclination >= ascending[0]) & (inclination <= ascending[-1])
    inside &= from_left <= left - right
    return np.where(inside, row * grid.columns + np.minimum(column, grid.columns - 1), -1)


@st.composite
def points_at_borders(draw: st.DrawFn) -> tuple[SphericalGrid, Float32s]:
    """Points on borders between rows, or columns, or so near that few floats lie between."""
    grid = draw(st.sampled_from(GRIDS))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    right, left = grid.azimuth
    column = rng.integers(0, grid.columns + 1, 50) + rng.choice([0, 0.4], 50)
    azimuth = left - (left - right) * column / grid.columns
    inclination = rng.choice([*grid.edges, np.mean(grid.edges)], 50)
    distance = 10 ** rng.uniform(*draw(st.sampled_from([(0, 2), (-3, 6), (-44, 38)])), 50)
    steps = draw(st.sampled_from([0, 1, 1000]))  # of the last place
    xyz = (unit_vectors(azimuth, inclination) * distance[:, None]).astype(np.float32)
    xyz += rng.integers(-steps, steps + 1, xyz.shape) * np.spacing(xyz)
    xyz[rng.random(xyz.shape) < 0.1] *= -0.0
    return grid, xyz


any_finite = hnp.arrays(
    np.float32,
    st.tuples(st.integers(0, 40), st.just(3)),
    elements=st.floats(allow_nan=False, allow_infinity=False, width=32),
)


@settings(max_examples=400)
@given(st.one_of(points_at_borders(), st.tuples(st.sampled_from(GRIDS), any_finite)))
def test_points_on_borders_and_elsewhere_have_the_pixel_of_their_angles(points) -> None:
    grid, xyz = points
    np.testing.assert_array_equal(grid.pixel(xyz), computed(grid, xyz))


def test_rounding_carries_no_point_across_a_border_that_hardly_lies_in_its_bin() -> None:
    heights = np.arange(6000, 4000, -100) + np.linspace(1e-4, 2e-3, 20)
    edges = np.degrees(np.arcsin(heights / (BINS // 2) - 1))
    grid, rng = SphericalGrid(1, (-30, 30), tuple(edges.tolist())), np.random.default_rng(0)
    xyz = unit_vectors(rng.uniform(-29, 29, 50_000), rng.choice(edges, 50_000))
    xyz = (xyz * rng.uniform(1, 100, (50_000, 1))).astype(np.float32)
    x, y, z = xyz.T
    carried = height_of(z, np.sqrt(x * x + y * y + z * z)) % 1 > 0.5
    assert carried.sum() > 100
    np.testing.assert_array_equal(grid.pixel(xyz), computed(grid, xyz))


def scattered(count: int) -> Float32s:
    """Points around a sensor, at most 70 degrees up or down."""
    rng = np.random.default_rng(0)
    xyz = rng.normal(size=(count, 3)) * [1, 1, 0.2]
    return (xyz * rng.uniform(0.5, 100, (count, 1))).astype(np.float32)


@pytest.mark.parametrize("grid", GRIDS, ids=str)
def test_so_have_scattered_points_and_those_of_many_chunks(grid, monkeypatch) -> None:
    xyz = scattered(20_000)
    expected = computed(grid, xyz)
    np.testing.assert_array_equal(grid.pixel(xyz), expected)
    monkeypatch.setattr("derain.views.direction_table.POINTS_AT_A_TIME", 777)
    np.testing.assert_array_equal(grid.pixel(xyz), expected)


@pytest.mark.parametrize("grid", PUBLISHED, ids=list(PUBLISHED_GRIDS))
def test_nearly_all_points_are_looked_up(grid) -> None:
    assert (grid.table(scattered(20_000)) < UNSURE_BELOW).mean() < 0.06


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 1e-3, 1e-6]))
def test_rounding_moves_no_point_by_a_quarter_of_the_margin(seed, flat) -> None:
    rng = np.random.default_rng(seed)
    xyz = rng.normal(size=(2000, 3)) * 10 ** rng.uniform(-9, 9, (2000, 1))
    xyz[:, rng.integers(3)] *= flat or 1.0
    x, y, z = xyz.T.astype(np.float32)
    height = height_of(z, np.sqrt(x * x + y * y + z * z))
    assert height.dtype == np.float32
    exact = height_of(xyz[:, 2], np.linalg.norm(xyz, axis=1))
    assert np.abs(height - exact).max() < BORDER_MARGIN / 4
    turn, exact = turn_of(x, y), turn_of(xyz[:, 0], xyz[:, 1])
    assert turn.dtype == np.float32
    assert np.abs(turn - exact).max() < BORDER_MARGIN / 4
    assert turn.min() >= 0
    assert turn.max() <= BINS
