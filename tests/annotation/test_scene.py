"""Rectangles, boxes and their corrections, and polygons of a scene."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from derain.annotation.scene import Box, Correction, Rectangle, inside
from derain.simulation.classes import TrackClass

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
    assert rectangle.relative(np.array([10.0, 3.0])).tolist() == pytest.approx([3, 0])


BOX = Box(TrackClass.CAR, (20, 1, -0.6), (4.5, 1.8, 1.5), 35)


def test_a_box_holds_what_a_rotation_takes_into_its_frame() -> None:
    points = np.random.default_rng(0).uniform((16, -3, -2), (24, 5, 1), (5000, 3))
    turned = Rotation.from_euler("z", BOX.heading, degrees=True).inv().apply(points - BOX.centre)
    expected = (np.abs(turned) <= np.array(BOX.size) / 2).all(axis=1)
    assert 100 < expected.sum() < 4000
    assert np.array_equal(BOX.contains(points), expected)


def test_its_faces_are_part_of_it() -> None:
    box = Box(TrackClass.TARGET, (0, 0, 0), (2, 4, 6))
    faces = np.array([[1, 0, 0], [0, 2, 0], [0, 0, 3], [1, 2, 3]], float)
    assert box.contains(faces).all()
    assert not box.contains(np.nextafter(faces, np.inf)).any()


def test_a_correction_changes_what_it_states_alone() -> None:
    assert BOX.corrected(Correction()) == BOX
    moved = BOX.corrected(Correction(shift=(1, 0, 0.25)))
    assert moved == Box(BOX.kind, (21, 1, -0.35), BOX.size, BOX.heading)
    resized = BOX.corrected(Correction(size=(1, 1, 1), heading=0.0))
    assert resized == Box(BOX.kind, BOX.centre, (1, 1, 1), 0)


def test_a_bent_road_holds_what_lies_in_one_of_its_parts() -> None:
    bend = ((0, 0), (10, 0), (10, 10), (8, 10), (8, 2), (0, 2))
    points = np.random.default_rng(0).uniform(-2, 12, (2000, 3))
    x, y, _ = points.T
    first = (x > 0) & (x < 10) & (y > 0) & (y < 2)
    second = (x > 8) & (x < 10) & (y > 0) & (y < 10)
    assert np.array_equal(inside(bend, points), first | second)
