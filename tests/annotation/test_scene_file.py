"""Scene files: every key is read, and an invalid one is named."""

from pathlib import Path

import pytest

from derain.annotation import scene_file
from derain.annotation.plane import PlaneSearch
from derain.annotation.scene import Box, Correction, Scene
from derain.annotation.scene_file import read_scene
from derain.errors import InputError
from derain.simulation.classes import TrackClass

SCENE = Scene(
    road=((2, -4), (60, -4), (60, 4), (2, 4)),
    boxes={
        "car_1": Box(TrackClass.CAR, (20, 1, -0.6), (4.5, 1.8, 1.5), 5),
        "mast_1": Box(TrackClass.SPRINKLER, (8, 4.5, 0.7), (0.3, 0.3, 4)),
    },
    rain_area=((0, -9), (60, -9), (60, 9), (0, 9)),
    height=0.15,
    plane=PlaneSearch(distance=0.2, points=3, iterations=50, scans=2, seed=7),
    corrections={"003": {"car_1": Correction((0.2, 0, 0), (4, 2, 1), 0.0)}, "010": {}},
)


TEXT = """\
road: [[2, -4], [60, -4], [60, 4], [2, 4]]
boxes:
  car_1: {class: car, centre: [20, 1, -0.6], size: [4.5, 1.8, 1.5], heading: 5}
  mast_1: {class: sprinkler, centre: [8, 4.5, 0.7], size: [0.3, 0.3, 4]}
rain_area: [[0, -9], [60, -9], [60, 9], [0, 9]]
height: 0.15
plane: {distance: 0.2, points: 3, iterations: 50, scans: 2, seed: 7}
corrections:
  "003": {boxes: {car_1: {shift: [0.2, 0, 0], size: [4, 2, 1], heading: 0}}}
  "010": {boxes: {}}
"""


ROAD = "road: [[0, 0], [1, 0], [0, 1]]\n"
BOX = "{class: car, centre: [0, 0, 0], size: [1, 1, 1]}"


def written(path: Path, text: str) -> Path:
    path.write_text(text, "utf-8")
    return path


def test_every_key_of_a_scene_is_read_and_the_road_is_all_that_it_needs(tmp_path: Path) -> None:
    assert read_scene(written(tmp_path / "scene.yaml", TEXT)) == SCENE
    assert read_scene(written(tmp_path / "road.yaml", ROAD)) == Scene(((0, 0), (1, 0), (0, 1)))


def test_the_example_of_the_description_can_be_read(tmp_path: Path) -> None:
    assert scene_file.__doc__ is not None
    _, example, _ = scene_file.__doc__.split("\n\n")
    scene = read_scene(written(tmp_path / "scene.yaml", example))
    assert scene.corrections == {"003": {"car_1": Correction(shift=(0.2, 0, 0))}}
    assert [box.kind for box in scene.boxes.values()] == [TrackClass.CAR, TrackClass.SPRINKLER]
    assert scene.height == Scene(scene.road).height
    assert scene.plane == PlaneSearch()


def test_corrections_hold_in_their_sequence_alone() -> None:
    assert SCENE.in_sequence("004").boxes == SCENE.boxes
    corrected = SCENE.in_sequence("003").boxes
    assert corrected["car_1"] == Box(TrackClass.CAR, (20.2, 1, -0.6), (4, 2, 1), 0)
    assert corrected["mast_1"] == SCENE.boxes["mast_1"]


@pytest.mark.parametrize(
    ("text", "key", "reason"),
    [
        ("boxes: {}", "", "road is missing"),
        (ROAD + "roof: 1", "roof", "there is no such key"),
        ("road: [[0, 0], [1, 0]]", "road", "2 corners make no polygon"),
        ("road: [[0, 0], [1, 0], [0, .nan]]", "road[2][1]", "nan is not a finite number"),
        ("road: [[0, 0], [1, 0], [0, 1, 2]]", "road[2]", "are not 2 numbers"),
        ("road: [[0, 0], [1, 0], [0, 1e300]]", "road[2][1]", "1e+300 is not within"),
        (ROAD + "height: -1e300", "height", "-1e+300 is not within"),
        (ROAD + "plane: {distance: 1e300}", "plane.distance", "1e+300 is not within"),
        (ROAD + "plane: {points: 2}", "plane.points", "2 is not a whole number from 3 to 100"),
        (ROAD + "plane: {distance: 0}", "plane.distance", "0 is not above 0"),
        (ROAD + "plane: {iterations: 1000000000000}", "plane.iterations", "is not a whole number"),
        (ROAD + "boxes: {a: {class: car}}", "boxes.a", "centre is missing"),
        (ROAD + f"boxes: {{a: {BOX.replace('car', 'cart')}}}", "boxes.a.class", "no class 'cart'"),
        (ROAD + f"boxes: {{a: {BOX.replace('1]', '1e300]')}}}", "boxes.a.size[2]", "not within"),
        (ROAD + f"boxes: {{a: {BOX.replace('1]', '0]')}}}", "boxes.a.size[2]", "0 is not above 0"),
        (ROAD + f"boxes: {{a: {BOX.replace('1]', '1, 1]')}}}", "boxes.a.size", "are not 3 numbers"),
        (ROAD + "corrections: {a: {boxes: {b: {}}}}", "corrections.a.boxes.b", "no such box"),
    ],
)
def test_what_cannot_be_meant_is_named_by_its_key(
    tmp_path: Path, text: str, key: str, reason: str
) -> None:
    path = written(tmp_path / "scene.yaml", text)
    with pytest.raises(InputError) as raised:
        read_scene(path)
    assert str(raised.value.subject) == (f"{path}: {key}" if key else str(path))
    assert reason in raised.value.reason
    assert raised.value.remedy.endswith(".")
