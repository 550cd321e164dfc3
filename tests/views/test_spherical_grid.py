"""The grid's pixels against the published formula, at every border, and in every notation."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derain.errors import InputError
from derain.simulation.sensor import unit_vectors
from derain.views.spherical_grid import SphericalGrid, grid_of

FULL = SphericalGrid.even(64, 2048, (-25, 15))
FRONT = SphericalGrid.even(4, 8, (-20, 20), (-40, 40))
BACKWARD = SphericalGrid.even(4, 8, (-20, 20), (140, 220))


@st.composite
def grids(draw: st.DrawFn) -> SphericalGrid:
    """Grids of any bounds, beams unevenly spaced."""
    span = draw(st.sampled_from([360.0, 200.0, 37.5, 1.0]))
    right = draw(st.floats(-300, 300))
    heights = draw(st.lists(st.floats(0.1, 20), min_size=1, max_size=8))
    bottom = draw(st.floats(-90, 90 - sum(heights) * 0.5)) if sum(heights) <= 170 else -90.0
    edges = bottom + np.cumsum([0.0, *heights]) * min(1.0, (89.9 - bottom) / sum(heights))
    columns = draw(st.integers(1, 40))
    return SphericalGrid(columns, (right, right + span), tuple(edges[::-1].tolist()))


def pixel(grid: SphericalGrid, *xyz: float) -> tuple[int, int] | None:
    """(row, column) of one point."""
    (number,) = grid.pixel(np.array([xyz], np.float32))
    return None if number < 0 else divmod(int(number), grid.columns)


def test_even_grids_are_the_published_projection() -> None:
    rng = np.random.default_rng(0)
    xyz = unit_vectors(rng.uniform(-180, 180, 20_000), rng.uniform(-25, 15, 20_000)).astype(
        np.float32
    )
    x, y, z = xyz.T.astype(np.float64)
    yaw, pitch = -np.arctan2(y, x), np.arcsin(z / np.sqrt(x * x + y * y + z * z))
    u = 0.5 * (yaw / np.pi + 1) * 2048
    v = (1 - (pitch + math.radians(25)) / math.radians(40)) * 64
    clear = (np.abs(u - np.round(u)) > 1e-8) & (np.abs(v - np.round(v)) > 1e-8)
    assert clear.mean() > 0.999
    expected = np.floor(v) * 2048 + np.floor(u)
    np.testing.assert_array_equal(FULL.pixel(xyz)[clear], expected[clear])


@given(grids())
def test_the_middle_of_every_pixel_lies_in_it(grid) -> None:
    right, left = grid.azimuth
    edges = np.array(grid.edges)
    azimuth = left - (left - right) * (np.arange(grid.columns) + 0.5) / grid.columns
    middles = unit_vectors(azimuth, ((edges[1:] + edges[:-1]) / 2)[:, None])
    expected = np.arange(grid.rows * grid.columns)
    np.testing.assert_array_equal(grid.pixel(middles), expected)


@pytest.mark.parametrize("y", [0.0, -0.0])
def test_straight_behind_is_column_0_of_a_full_circle_whatever_the_sign_of_zero(y) -> None:
    assert pixel(FULL, -10, y, -1) == pixel(FULL, -10, 1e-6, -1)
    assert pixel(FULL, -10, y, -1) == (33, 0)
    assert pixel(FULL, -10, -1e-3, -1) == (33, 2047)
    assert pixel(BACKWARD, -10, y, -1) == (2, 4)
    assert pixel(FRONT, -10, y, -1) is None


def test_a_full_circle_may_begin_anywhere() -> None:
    grid = SphericalGrid.even(1, 4, (-10, 10), (-90, 270))
    ahead, left, behind, right = (10, 0, 0), (0, 10, 0), (-10, 0, 0), (0, -10, 0)
    assert grid.is_full_circle
    columns = [pixel(grid, *xyz) for xyz in (right, behind, left, ahead)]
    assert columns == [(0, 0), (0, 1), (0, 2), (0, 3)]
    assert pixel(grid, 1e-6, -10, 0) == (0, 3)
    # So little past the first column's border that its azimuth differs from 360 by no float.
    assert pixel(SphericalGrid.even(1, 4, (-10, 10), (-360, 0)), 10, 1e-20, 0) == (0, 3)


def test_poles_have_the_direction_straight_ahead() -> None:
    grid = SphericalGrid.even(4, 8, (-90, 90))
    for zeros in [(0.0, 0.0), (-0.0, 0.0), (0.0, -0.0), (-0.0, -0.0)]:
        assert pixel(grid, *zeros, 5) == (0, 4)
        assert pixel(grid, *zeros, -5) == (3, 4)
        assert pixel(FULL, *zeros, 5) is None


def test_borders_belong_to_the_pixel_below_and_to_the_right_and_bounds_to_the_grid() -> None:
    grid = SphericalGrid.even(2, 4, (-45, 45), (-90, 90))
    assert pixel(grid, 10, 0, 0) == (1, 2)
    assert pixel(grid, 10, 10, 0) == (1, 1)
    assert pixel(grid, 10, -10, -0.0) == (1, 3)
    assert pixel(grid, 0, 10, 10) == (0, 0)
    assert pixel(grid, 0, -10, -10) == (1, 3)
    for outside in ((0, 10, 10.001), (0, 10, -10.001), (-1e-3, 10, 0), (-1e-3, -10, 0)):
        assert pixel(grid, *outside) is None


def test_every_beam_has_its_own_row() -> None:
    beams = [-24.9, 14.8, 2.0, 0.3, -0.1, -8.0]
    grid = SphericalGrid.of_beams(beams, 16)
    assert grid.rows == 6
    np.testing.assert_allclose(grid.edges, [21.2, 8.4, 1.15, 0.1, -4.05, -16.45, -33.35])
    rows = grid.pixel(unit_vectors(0.0, np.sort(beams)[::-1])) // 16
    assert rows.tolist() == [0, 1, 2, 3, 4, 5]


def test_beams_at_the_poles_stay_below_them() -> None:
    assert SphericalGrid.of_beams([90, 70, -80], 4).edges == (90.0, 80.0, -5.0, -90.0)


@pytest.mark.parametrize(
    ("name", "inclination"),
    [("semantickitti", (-25, 3)), ("rehearse3d", (-20, 15)), ("wads", (-27.941, 16.767))],
)
def test_published_grids_are_known_by_name(name, inclination) -> None:
    grid = grid_of(name, "config.yaml")
    assert (grid.rows, grid.columns) == (64, 2048)
    assert grid.is_full_circle
    assert (grid.edges[-1], grid.edges[0]) == pytest.approx(inclination)


def test_a_user_describes_a_grid_by_its_inclination_or_its_beams() -> None:
    even = {"rows": 64, "columns": 448, "inclination": [-18, 8], "azimuth": [-58, 58]}
    assert grid_of(even, "x.yaml") == SphericalGrid.even(64, 448, (-18, 8), (-58, 58))
    beams = {"beams": [-3, 0, 2.5], "columns": 64}
    assert grid_of(beams, "x.yaml") == SphericalGrid.of_beams([-3, 0, 2.5], 64)


@pytest.mark.parametrize(
    ("config", "reason"),
    [
        ("kitti", "no grid named 'kitti'"),
        (None, "it is empty"),
        ({}, "columns is missing"),
        ({"columns": 64}, "its rows are described by nothing"),
        ({"columns": 64, "rows": 16}, "described by rows"),
        ({"columns": 64, "rows": 16, "inclination": [-5, 5], "beams": [1, 2]}, "described by"),
        ({"columns": 64, "rows": 16, "inclination": [-5, 5], "fov": 3}, "fov: there is no"),
        ({"columns": 6.5, "rows": 16, "inclination": [-5, 5]}, "columns: 6.5 is not"),
        ({"columns": 64, "rows": 16, "inclination": [-5]}, "inclination: [-5] are not 2 numbers"),
        ({"columns": 64, "rows": 16, "inclination": [5, -5]}, "inclination from 5 to -5"),
        ({"columns": 64, "rows": 16, "inclination": [-95, 5]}, "inclination from -95 to 5"),
        ({"columns": 0, "rows": 16, "inclination": [-5, 5]}, "0 is not a whole number from 1 to 4"),
        ({"columns": 10**9, "rows": 10**9, "inclination": [-5, 5]}, "columns: 1000000000 is not"),
        ({"columns": 2**12, "rows": 2**11, "inclination": [-5, 5]}, "2048 rows by 4096 columns"),
        ({"columns": 64, "rows": 16, "inclination": [-5, 10**400]}, "too large"),
        ({"columns": 64, "beams": [1.0]}, "a grid of fewer than two beams"),
        ({"columns": 64, "beams": [1.0, 1.0]}, "a grid of inclination from 1 to 1"),
        ({"columns": 64, "edges": []}, "a grid of -1 rows"),
        ({"columns": 64, "edges": [1.0, 2.0]}, "a grid of inclination from 2 to 1"),
        ({"columns": 64, "edges": [2.0, 1.0], "azimuth": [40, -40]}, "azimuth from 40 to -40"),
        ({"columns": 64, "edges": [2.0, 1.0], "azimuth": [-180, 181]}, "azimuth from -180 to 181"),
    ],
)
def test_what_is_not_a_grid_is_refused_with_its_reason(config, reason) -> None:
    with pytest.raises(InputError, match=r"config\.yaml") as error:
        grid_of(config, "config.yaml")
    assert reason in str(error.value)
