"""The road's plane is found among rain and things; points get their class from where they lie."""

import numpy as np
import pytest

from derain.annotation.scene import Box, Scene
from derain.annotation.steps import MOST_POINTS, Plane, annotate, road_plane
from derain.errors import InputError
from derain.fusion import UNKNOWN
from derain.scan import Floats, Scan
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


def road(points: int, slope: tuple[float, float] = (0.0, 0.0), seed: int = 0) -> Floats:
    """A road 1.5 m under the sensor, measured to a centimetre, float64 (points, 3)."""
    generator = np.random.default_rng(seed)
    x, y = generator.uniform(2, 60, points), generator.uniform(-4, 4, points)
    z = slope[0] * x + slope[1] * y - 1.5 + generator.normal(0, 0.01, points)
    return np.column_stack([x, y, z])


def plane_of(points: Floats) -> Plane:
    return road_plane([Scan.of(points, "scan")], Scene(((-9, -9), (99, -9), (99, 99), (-9, 99))))


def test_a_sloping_road_is_found_through_rain_and_heights_are_distances_from_it() -> None:
    rain = np.random.default_rng(1).uniform((2, -4, -1.2), (20, 4, 3), (2000, 3))
    sloping = road(3000, (0.03, -0.02))
    plane = plane_of(np.concatenate([rain, sloping]))
    expected = np.array([-0.03, 0.02, 1]) / np.linalg.norm([-0.03, 0.02, 1])
    np.testing.assert_allclose(plane.normal, expected, atol=1e-3)
    assert plane.slope == pytest.approx(np.degrees(np.arctan(np.hypot(0.03, 0.02))), abs=0.05)
    assert np.abs(plane.height(sloping)).max() < 0.06
    up = np.array(plane.normal)
    np.testing.assert_allclose(plane.height(sloping + 3 * up) - plane.height(sloping), 3)
    many = road(MOST_POINTS + 1)  # more than are searched
    assert plane_of(many) == plane_of(many[::-1])


def test_a_wall_and_too_few_points_are_no_road() -> None:
    with pytest.raises(InputError, match=r"scan: .* (8[0-9]|90) degrees"):
        plane_of(road(500)[:, [2, 1, 0]])
    assert plane_of(road(9)).normal[2] > 0.9
    with pytest.raises(InputError, match="8 points over the road are too few"):
        plane_of(road(8))


def test_the_plane_is_that_of_the_road_of_all_scans_though_a_wall_has_more_points() -> None:
    generator = np.random.default_rng(0)
    wall = np.column_stack(
        [np.full(9000, 40), generator.uniform(5, 30, 9000), generator.uniform(-1.5, 8, 9000)]
    )
    roof = road(3000, seed=1) * (0.04, 0.2, 0) + (18.5, 0, -0.1)  # of the car, in its box
    left, right = (road(2000, seed=seed) * (1, 0, 1) + (0, 2, 0.06) for seed in (2, 3))
    right *= (1, -1, 1)
    right[:, 2] -= 0.12
    scans = [
        Scan(np.concatenate([wall, roof, side]).astype(np.float32), name="scan.bin")
        for side in (left, right)
    ]
    plane = road_plane(scans, SCENE)
    assert plane.slope == pytest.approx(np.degrees(np.arctan(0.12 / 4)), abs=0.1)
    assert plane.offset == pytest.approx(1.5, abs=0.01)
    elsewhere = Scan(-road(2000).astype(np.float32), name="scan.bin")
    with pytest.raises(InputError, match=r"scan\.bin: 0 points over the road"):
        road_plane([elsewhere], SCENE)


WIDER = Scene(SCENE.road, SCENE.boxes, rain_area=((0, -9), (25, -9), (25, 9), (0, 9)))


def label_of(*point: float, scene: Scene = SCENE) -> int:
    return int(annotate(Scan.of(np.array([[*point, 50]], np.float32)), scene, PLANE)[0])


@pytest.mark.parametrize(
    ("scene", "point", "expected"),
    [
        (SCENE, (30, 0, 0), TrackClass.RAIN),
        (SCENE, (30, 0, -1.35), TrackClass.RAIN),
        (SCENE, (30, 0, -1.45), TrackClass.ROAD),
        (SCENE, (30, 0, -3), TrackClass.ROAD),
        (SCENE, (30, 5, -1.5), TrackClass.BACKGROUND),
        (SCENE, (21.8, 0, -1), TrackClass.CAR),
        (SCENE, (22.3, 0, -1), TrackClass.PEDESTRIAN),
        (SCENE, (10, 3, 1.5), TrackClass.SPRINKLER),
        (SCENE, (10, 2, 1.5), TrackClass.BACKGROUND),
        (SCENE, (10, 3, -1.6), UNKNOWN),
        (SCENE, (10, 3, -1.4), TrackClass.SPRINKLER),
        (SCENE, (np.nan, 0, 0), UNKNOWN),
        (WIDER, (15, 7, 0), TrackClass.RAIN),
        (WIDER, (15, 7, -1.5), TrackClass.BACKGROUND),
        (WIDER, (30, 0, 0), TrackClass.ROAD),
    ],
)
def test_a_point_gets_its_class_from_where_it_lies(scene, point, expected) -> None:
    assert label_of(*point, scene=scene) == expected


def test_all_points_together_are_labelled_as_each_alone() -> None:
    points = np.random.default_rng(0).uniform((0, -6, -2), (30, 6, 3), (400, 3))
    together = annotate(Scan(points.astype(np.float32)), SCENE, PLANE)
    assert together.tolist() == [label_of(*point) for point in points.astype(np.float32)]
    assert set(together) >= {0, 1, 2, 3, 7}
