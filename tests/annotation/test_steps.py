"""Points get their class from where they lie, step by step."""

import numpy as np
import pytest
from numpy.typing import NDArray

from derain.annotation.plane import Plane
from derain.annotation.scene import Box, Scene
from derain.annotation.steps import annotate, road_plane
from derain.errors import InputError
from derain.evaluation.hard_cases import hard_cases
from derain.fusion import UNKNOWN
from derain.scan import Scan
from derain.simulation.classes import TrackClass

PLANE = Plane((0.0, 0.0, 1.0), 1.5)
SCENE = Scene(
    road=((2, -4), (60, -4), (60, 4), (2, 4)),
    boxes={
        "car": Box(TrackClass.CAR, (20, 0, -0.75), (4, 2, 1.4)),
        "dog": Box(TrackClass.PEDESTRIAN, (22, 0, -1), (1, 1, 1)),  # overlaps the car's
        "mast": Box(TrackClass.SPRINKLER, (10, 3, 0), (0.4, 0.4, 4)),  # reaches under the road
        "bough": Box(TrackClass.BACKGROUND, (10, 2, 1.5), (3, 3, 1)),  # and over the mast's
    },
)


def label_of(*point: float, scene: Scene = SCENE) -> int:
    return int(annotate(Scan.of(np.array([[*point, 50]], np.float32)), scene, PLANE)[0])


@pytest.mark.parametrize(
    ("point", "expected"),
    [
        ((30, 0, 0), TrackClass.RAIN),
        ((30, 0, -1.35), TrackClass.RAIN),
        ((30, 0, -1.45), TrackClass.ROAD),
        ((30, 0, -3), TrackClass.ROAD),
        ((30, 5, -1.5), TrackClass.BACKGROUND),
        ((21.8, 0, -1), TrackClass.CAR),
        ((22.3, 0, -1), TrackClass.PEDESTRIAN),
        ((10, 3, 1.5), TrackClass.SPRINKLER),
        ((10, 2, 1.5), TrackClass.BACKGROUND),
        ((10, 3, -1.6), UNKNOWN),
        ((10, 3, -1.4), TrackClass.SPRINKLER),
        ((np.nan, 0, 0), UNKNOWN),
    ],
)
def test_a_point_gets_its_class_from_where_it_lies(
    point: tuple[float, float, float], expected: int
) -> None:
    assert label_of(*point) == expected


def test_rain_beside_the_road_is_labelled_where_the_scene_says_so() -> None:
    wider = Scene(SCENE.road, SCENE.boxes, rain_area=((0, -9), (25, -9), (25, 9), (0, 9)))
    assert label_of(15, 7, 0, scene=wider) == TrackClass.RAIN
    assert label_of(15, 7, -1.5, scene=wider) == TrackClass.BACKGROUND
    assert label_of(30, 0, 0, scene=wider) == TrackClass.ROAD


def test_all_points_together_are_labelled_as_each_alone() -> None:
    points = np.random.default_rng(0).uniform((0, -6, -2), (30, 6, 3), (400, 3))
    together = annotate(Scan(points.astype(np.float32)), SCENE, PLANE)
    assert together.tolist() == [label_of(*point) for point in points.astype(np.float32)]
    assert set(together) >= {0, 1, 2, 3, 7}


@pytest.mark.parametrize(("name", "scan"), list(hard_cases(500)))
def test_every_row_of_a_hard_case_gets_a_class(name: str, scan: Scan) -> None:
    label = annotate(scan, SCENE, PLANE)
    assert label.shape == (len(scan),)
    assert set(label[scan.valid]) <= {*TrackClass, UNKNOWN}
    assert (label[~scan.valid] == UNKNOWN).all()


def road_of(seed: int, points: int = 2000) -> NDArray[np.float64]:
    generator = np.random.default_rng(seed)
    x, y = generator.uniform(2, 60, points), generator.uniform(-4, 4, points)
    return np.column_stack([x, y, generator.normal(-1.5, 0.01, points)])


def test_the_plane_is_that_of_the_road_though_a_wall_has_more_points() -> None:
    generator = np.random.default_rng(0)
    wall = np.column_stack(
        [np.full(9000, 40), generator.uniform(5, 30, 9000), generator.uniform(-1.5, 8, 9000)]
    )
    roof = road_of(1, 3000) * (0.04, 0.2, 0) + (18.5, 0, -0.1)  # of the car, in its box
    scan = Scan(np.concatenate([wall, roof, road_of(0)]).astype(np.float32))
    plane = road_plane([scan], SCENE)
    assert plane.offset == pytest.approx(1.5, abs=0.01)
    assert plane.slope < 0.1


def test_the_scans_of_a_sequence_have_one_plane() -> None:
    left, right = road_of(0) * (1, 0, 1) + (0, 2, 0), road_of(1) * (1, 0, 1) - (0, 2, 0)
    left[:, 2] += 0.06
    right[:, 2] -= 0.06
    scans = [Scan(points.astype(np.float32)) for points in (left, right)]
    plane = road_plane(scans, SCENE)
    assert plane.slope == pytest.approx(np.degrees(np.arctan(0.12 / 4)), abs=0.1)


def test_a_scene_elsewhere_has_no_plane() -> None:
    scan = Scan(road_of(0).astype(np.float32) * np.float32(-1), name="scan.bin")
    with pytest.raises(InputError, match=r"scan\.bin: 0 points over the road"):
        road_plane([scan], SCENE)
