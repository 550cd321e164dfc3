"""Scenes: boxes, their corrections, polygons, and the file that describes them."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derain.annotation import scene as module
from derain.annotation.scene import Box, Scene, read_scene
from derain.errors import InputError
from derain.simulation.classes import TrackClass

lengths = st.floats(0.1, 50)
places = st.floats(-100, 100)
boxes = st.builds(
    Box,
    st.just(TrackClass.CAR),
    st.tuples(places, places, places),
    st.tuples(lengths, lengths, lengths),
    st.floats(-180, 180),
)


@given(boxes, st.integers(0, 2**32 - 1))
def test_a_point_is_inside_where_combining_the_sides_leads_to_it(box, seed) -> None:
    shares = np.random.default_rng(seed).uniform(-1, 1, (50, 2))
    shares = shares[np.abs(np.abs(shares) - 0.5).min(axis=1) > 1e-6]
    first, second, _, fourth = box.corners()
    along, across = first - second, first - fourth
    x, y, z = box.centre
    points = (x, y) + shares[:, :1] * along + shares[:, 1:] * across
    points = np.column_stack([points, np.full(len(points), z)])
    assert np.array_equal(box.contains(points), (np.abs(shares) < 0.5).all(axis=1))


def test_the_length_runs_along_the_heading() -> None:
    box = Box(TrackClass.CAR, (10, 0, 0), (4, 2, 1), 90)
    corners = {(round(x, 9), round(y, 9)) for x, y in box.corners()}
    assert corners == {(11, 2), (11, -2), (9, 2), (9, -2)}


def test_a_box_ends_at_its_faces() -> None:
    box = Box(TrackClass.TARGET, (0, 0, 0), (2, 4, 6))
    faces = np.array([[1, 0, 0], [0, 2, 0], [0, 0, 3], [1, 2, 3]], float)
    assert box.contains(faces * (1 - 1e-9)).all()
    assert not box.contains(faces * (1 + 1e-9)).any()


SCENE = Scene(
    road=((2, -4), (60, -4), (60, 4), (2, 4)),
    boxes={
        "car_1": Box(TrackClass.CAR, (20, 1, -0.6), (4.5, 1.8, 1.5), 5),
        "mast_1": Box(TrackClass.SPRINKLER, (8, 4.5, 0.7), (0.3, 0.3, 4)),
    },
    rain_area=((0, -9), (60, -9), (60, 9), (0, 9)),
    height=0.15,
    corrections={
        "003": {"car_1": {"shift": (0.2, 0, 0), "size": (4, 2, 1), "heading": 0.0}},
        "005": {"car_1": {"shift": (1, 0, 0.25)}},
        "010": {},
    },
)

TEXT = """\
road: [[2, -4], [60, -4], [60, 4], [2, 4]]
boxes:
  car_1: {class: car, centre: [20, 1, -0.6], size: [4.5, 1.8, 1.5], heading: 5}
  mast_1: {class: sprinkler, centre: [8, 4.5, 0.7], size: [0.3, 0.3, 4]}
rain_area: [[0, -9], [60, -9], [60, 9], [0, 9]]
height: 0.15
corrections:
  "003": {boxes: {car_1: {shift: [0.2, 0, 0], size: [4, 2, 1], heading: 0}}}
  "005": {boxes: {car_1: {shift: [1, 0, 0.25]}}}
  "010": {boxes: {}}
"""

ROAD = "road: [[0, 0], [1, 0], [0, 1]]\n"
BOX = "{class: car, centre: [0, 0, 0], size: [1, 1, 1]}"


def read(folder: Path, text: str) -> Scene:
    path = folder / "scene.yaml"
    path.write_text(text, "utf-8")
    return read_scene(path)


def test_every_key_of_a_scene_is_read_and_the_road_is_all_that_it_needs(tmp_path) -> None:
    assert read(tmp_path, TEXT) == SCENE
    assert read(tmp_path, ROAD) == Scene(((0, 0), (1, 0), (0, 1)))
    _, example, _ = module.__doc__.split("\n\n")
    assert [*read(tmp_path, example).boxes] == ["car_1", "mast_1"]


def test_corrections_hold_in_their_sequence_and_change_what_they_state_alone() -> None:
    assert SCENE.in_sequence("004").boxes == SCENE.boxes
    replaced, moved = (SCENE.in_sequence(name).boxes for name in ("003", "005"))
    assert replaced["car_1"] == Box(TrackClass.CAR, (20.2, 1, -0.6), (4, 2, 1), 0)
    assert replaced["mast_1"] == SCENE.boxes["mast_1"]
    assert moved["car_1"] == Box(TrackClass.CAR, (21, 1, -0.35), (4.5, 1.8, 1.5), 5)


@pytest.mark.parametrize(
    ("text", "key", "reason"),
    [
        ("boxes: {}", "", "road is missing"),
        (ROAD + "roof: 1", "roof", "there is no such key"),
        ("road: [[0, 0], [1, 0]]", "road", "2 corners make no polygon"),
        ("road: [[0, 0], [1, 0], [0, 1, 2]]", "road[2]", "are not 2 numbers"),
        ("road: [[0, 0], [1, 0], [0, 1e300]]", "road[2][1]", "1e+300 is not within"),
        (ROAD + "boxes: {a: {class: car}}", "boxes.a", "centre is missing"),
        (
            ROAD + f"boxes: {{a: {BOX.replace('car', 'cart')}}}",
            "boxes.a.class",
            "'cart' is not known",
        ),
        (ROAD + f"boxes: {{a: {BOX.replace('1]', '0]')}}}", "boxes.a.size[2]", "0 is not above 0"),
        (ROAD + "corrections: {a: {boxes: {b: {}}}}", "corrections.a.boxes.b", "no such box"),
    ],
)
def test_what_cannot_be_meant_is_named_by_its_key(tmp_path, text, key, reason) -> None:
    with pytest.raises(InputError) as raised:
        read(tmp_path, text)
    path = tmp_path / "scene.yaml"
    assert str(raised.value.subject) == (f"{path}: {key}" if key else str(path))
    assert reason in raised.value.reason
    assert not raised.value.remedy.endswith(": .")
