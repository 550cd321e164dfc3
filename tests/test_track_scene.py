"""The scene described for a simulated track labels what the simulator knows."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.track_scene import Rectangle, rectangle_around, scene_of_track
from derain.annotation.scene import Scene, inside
from derain.annotation.steps import annotate, road_plane
from derain.fusion import UNKNOWN
from derain.simulation import objects
from derain.simulation.classes import TrackClass
from derain.simulation.facility import lay_out_facility
from derain.simulation.rain import rain_on_beams
from derain.simulation.rain_field import SprinkledRain
from derain.simulation.sensor import Sensor
from derain.simulation.track import Track

SENSOR = Sensor(rows=96, columns=500)


@pytest.fixture(scope="module")
def track() -> Track:
    return lay_out_facility(np.random.default_rng(1))


def test_labels_agree_with_the_truth_where_rain_is_looked_for(track) -> None:
    scene = scene_of_track(track, SENSOR, beside=10)
    generator = np.random.default_rng(0)
    falling = rain_on_beams(
        track.cast(SENSOR), SENSOR.beams(), SprinkledRain(50), SENSOR, generator
    )
    scan = SENSOR.measure(falling, generator)
    label = annotate(scan, scene, road_plane([scan], scene))
    counted = label != UNKNOWN
    assert (label == scan.label)[counted].mean() > 0.99
    rain, called = scan.label == TrackClass.RAIN, label == TrackClass.RAIN
    assert rain.sum() > 500
    assert (rain & called).sum() / (rain | called).sum() > 0.95


def test_every_thing_of_the_track_is_in_boxes_of_its_class(track) -> None:
    scene = scene_of_track(track, SENSOR)
    assert scene.rain_area is None  # without ground beside the road
    for kind in (TrackClass.CAR, TrackClass.SPRINKLER, TrackClass.BIKE, TrackClass.TARGET):
        corners = track.triangles[track.label == kind].reshape(-1, 3).astype(float)
        corners -= (0, 0, SENSOR.mounting_height)
        corners = corners[corners[:, 2] > corners[:, 2].min() + 0.5]
        boxes = [box for box in scene.boxes.values() if box.kind is kind]
        assert np.any([box.contains(corners) for box in boxes], axis=0).all()


def test_what_stands_apart_is_boxed_apart_and_bushes_as_a_whole() -> None:
    generator = np.random.default_rng(0)
    mast = objects.sprinkler(generator).placed(10, 5)
    bush = objects.foliage((0.5, 0.5, 0.5), 1, generator)
    track = Track.of(
        [
            objects.asphalt((0, 50), (-4, 4), generator),
            mast,
            bush.placed(20, 0),
            bush.placed(30, 0),
            bush.placed(20, 20),  # not over the road
            objects.ground((-10, 60), (-50, 50), generator),
        ]
    )
    kinds = [box.kind for box in scene_of_track(track, SENSOR).boxes.values()]
    assert kinds.count(TrackClass.SPRINKLER) == 3  # mast, arm and foot
    assert kinds.count(TrackClass.BACKGROUND) == 2
    assert len(kinds) == 5


def test_the_road_is_the_one_of_the_track() -> None:
    track = Track.of([objects.asphalt((0, 50), (-4, 4), np.random.default_rng(0))])
    scene = scene_of_track(track, SENSOR)
    assert scene == Scene(scene.road)
    np.testing.assert_allclose(sorted(scene.road), [(0, -4), (0, 4), (50, -4), (50, 4)], atol=1e-2)


lengths = st.floats(0.1, 50)
places = st.floats(-100, 100)
rectangles = st.builds(
    Rectangle, st.tuples(places, places), st.tuples(lengths, lengths), st.floats(-180, 180)
)


@given(rectangles)
def test_the_tightest_rectangle_around_corners_is_the_one_they_are_of(rectangle) -> None:
    found = rectangle_around(rectangle.corners())
    assert sorted(found.size) == pytest.approx(sorted(rectangle.size), abs=5e-3)
    assert found.centre == pytest.approx(rectangle.centre, abs=5e-3)
    wider = replace(found, size=np.add(found.size, 2e-6)).corners()
    assert inside(wider, rectangle.corners()).all()


def test_a_single_point_has_a_rectangle_without_extent() -> None:
    found = rectangle_around(np.array([[3.0, 4.0]]))
    assert found.size == (0, 0)
    assert found.centre == pytest.approx((3, 4))
