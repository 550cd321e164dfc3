"""Rectangles on the ground."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derain.annotation.rectangle import Rectangle

lengths = st.floats(0.1, 50)
places = st.floats(-100, 100)
rectangles = st.builds(
    Rectangle, st.tuples(places, places), st.tuples(lengths, lengths), st.floats(-180, 180)
)


@given(rectangles, st.integers(0, 2**32 - 1))
def test_a_point_is_inside_where_combining_the_sides_leads_to_it(
    rectangle: Rectangle, seed: int
) -> None:
    shares = np.random.default_rng(seed).uniform(-1, 1, (50, 2))
    shares = shares[np.abs(np.abs(shares) - 0.5).min(axis=1) > 1e-6]
    first, second, _, fourth = rectangle.corners()
    along, across = first - second, first - fourth
    points = rectangle.centre + shares[:, :1] * along + shares[:, 1:] * across
    assert np.array_equal(rectangle.contains(points), (np.abs(shares) < 0.5).all(axis=1))


def test_the_length_runs_along_the_heading() -> None:
    rectangle = Rectangle((10, 0), (4, 2), 90)
    corners = {(round(x, 9), round(y, 9)) for x, y in rectangle.corners()}
    assert corners == {(11, 2), (11, -2), (9, 2), (9, -2)}
    assert rectangle.widened(1).size == (6, 4)
    assert rectangle.relative(np.array([10.0, 3.0])).tolist() == pytest.approx([3, 0])


@given(rectangles)
def test_the_tightest_rectangle_around_corners_is_the_one_they_are_of(
    rectangle: Rectangle,
) -> None:
    found = Rectangle.around(rectangle.corners())
    assert sorted(found.size) == pytest.approx(sorted(rectangle.size), abs=5e-3)
    assert found.centre == pytest.approx(rectangle.centre, abs=5e-3)
    assert found.widened(1e-6).contains(rectangle.corners()).all()


def test_a_single_point_has_a_rectangle_without_extent() -> None:
    found = Rectangle.around(np.array([[3.0, 4.0]]))
    assert found.size == (0, 0)
    assert found.centre == pytest.approx((3, 4))
