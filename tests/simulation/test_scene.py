"""What a sensor sees of a scene in which it, and others, move."""

from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest

from derain.simulation import shapes
from derain.simulation.campaign import Campaign
from derain.simulation.classes import TrackClass, unpacked
from derain.simulation.drive import Course, Drive
from derain.simulation.objects import Surface
from derain.simulation.rain_field import UniformRain
from derain.simulation.scene import SimulatedScene
from derain.simulation.sensor import Returns, Sensor
from derain.simulation.track import Track
from derain.simulation.traffic import MovingThing
from derain.simulation.weather import Weather

from .moved import moved

SENSOR = Sensor(rows=32, columns=200)
TIMES = np.array([0.0, 0.1, 0.7])
DRIVING = Campaign(scans=3, sensor=SENSOR, drive=Drive(speed=13, traffic=7))


def scene(campaign: Campaign, seed: int = 0) -> SimulatedScene:
    return SimulatedScene.of(campaign, "001", np.random.default_rng(seed))


def of_surfaces(
    *surfaces: Surface, course: Course | None, traffic: tuple[MovingThing, ...] = ()
) -> SimulatedScene:
    weather = Weather.of(0.0, 0.0, (0.0, 0.0))
    return SimulatedScene(Track.of(surfaces), UniformRain(0), weather, course, traffic)


def points(returns: Returns, pose: np.ndarray) -> np.ndarray:
    """Where the beams end in the scene, float64 (N, 3)."""
    return (SENSOR.beams() * returns.range[:, None]) @ pose[:3, :3].T + pose[:3, 3]


def test_walls_and_ground_stay_where_they_are_by_the_poses(open3d: ModuleType) -> None:
    front, side, ground = (
        Surface(triangles, kind, 0.5)
        for triangles, kind in (
            (shapes.placed(shapes.box(1, 200, -1, 60), 50.5, 0), TrackClass.TARGET),
            (shapes.placed(shapes.box(400, 1, -1, 60), 0, 8.5), TrackClass.CAR),
            (shapes.rectangle((-300, 300), (-300, 300), 0), TrackClass.ROAD),
        )
    )
    course = Course.draw(13, np.random.default_rng(3))
    seen = of_surfaces(front, side, ground, course=course).cast(SENSOR, TIMES)
    for time, returns in zip(TIMES, seen, strict=True):
        ends = points(returns, course.pose(time, SENSOR))
        for kind, axis, place in (("TARGET", 0, 50), ("CAR", 1, 8), ("ROAD", 2, 0)):
            hit = returns.returned & (returns.label == TrackClass[kind])
            assert hit.sum() > 100
            assert np.allclose(ends[hit, axis], place, atol=2e-3)


def test_what_moves_is_seen_as_if_it_were_built_into_the_street(open3d: ModuleType) -> None:
    drive = scene(DRIVING)
    seen = list(drive.cast(SENSOR, TIMES))
    for time, returns in zip(TIMES, seen, strict=True):
        moving = Track.of(
            replace(thing.surface, triangles=moved(thing, time)) for thing in drive.traffic
        )
        whole = Track.joined([drive.track, moving])
        expected = whole.cast(SENSOR, drive.course.pose(time, SENSOR))
        assert np.allclose(returns.range, expected.range, rtol=1e-5)
        assert np.allclose(returns.reflectivity, expected.reflectivity, atol=1e-5)
        assert np.array_equal(unpacked(returns.label)[0], expected.label)
        assert np.array_equal(returns.beam, expected.beam)
    assert any(unpacked(returns.label)[1].any() for returns in seen)


def test_the_numbers_of_what_moves_are_on_it_and_on_nothing_else(open3d: ModuleType) -> None:
    drive = scene(DRIVING)
    for time, returns in zip(TIMES, drive.cast(SENSOR, TIMES), strict=True):
        ends = points(returns, drive.course.pose(time, SENSOR))
        kind, number = unpacked(returns.label)
        assert number.max() <= len(drive.traffic)
        for row, thing in enumerate(drive.traffic, 1):
            corners = moved(thing, time).reshape(-1, 3)
            inside = ((ends > corners.min(0) - 2e-3) & (ends < corners.max(0) + 2e-3)).all(1)
            assert inside[number == row].all()
            assert (kind[number == row] == thing.surface.label).all()
            assert (number[inside & returns.returned & (kind == thing.surface.label)] == row).all()


def test_a_thing_moves_on_by_its_speed_while_the_street_stands(open3d: ModuleType) -> None:
    wall = Surface(shapes.placed(shapes.box(1, 60, 0, 30), 40, 0), TrackClass.BACKGROUND, 0.5)
    box = Surface(shapes.placed(shapes.box(1, 4, 0, 3), 15, 0), TrackClass.CAR, 0.5)
    away = MovingThing(box, np.array([5.0, 0.0]))
    course = Course.draw(0, np.random.default_rng(0))
    seen = of_surfaces(wall, course=course, traffic=(away,)).cast(SENSOR, TIMES)
    for time, returns in zip(TIMES, seen, strict=True):
        ends = points(returns, course.pose(time, SENSOR))
        kind, number = unpacked(returns.label)
        assert ends[number == 1, 0].min() == pytest.approx(14.5 + 5 * time, abs=2e-3)
        standing = returns.returned & (kind == TrackClass.BACKGROUND)
        assert ends[standing, 0].min() == pytest.approx(39.5, abs=2e-3)


def test_without_a_drive_every_scan_is_of_the_same_cast(open3d: ModuleType) -> None:
    standing = scene(replace(DRIVING, drive=None))
    first, second, third = standing.cast(SENSOR, TIMES)
    assert standing.course is None
    assert first is second is third
    assert np.array_equal(first.range, standing.track.cast(SENSOR).range)


@pytest.mark.parametrize("speed", [0.0, 13.0])
def test_a_skewed_scan_is_each_beam_of_the_scene_at_its_own_time(
    open3d: ModuleType, speed: float
) -> None:
    sensor = Sensor(rows=16, columns=50, frame_rate=2)
    straight = scene(Campaign(scans=2, sensor=sensor, drive=Drive(speed, traffic=7)))
    (skewed,) = replace(straight, skew=True).cast(sensor, TIMES[1:2])
    for column in (0, 20, 49):
        moment = TIMES[1] + column / 50 / sensor.frame_rate
        (expected,) = straight.cast(sensor, np.array([moment]))
        beams = np.arange(column, 16 * 50, 50)
        assert np.allclose(skewed.range[beams], expected.range[beams], rtol=1e-6)
        assert np.array_equal(skewed.label[beams], expected.label[beams])
    (at_once,) = straight.cast(sensor, TIMES[1:2])
    assert not np.allclose(skewed.range, at_once.range, atol=0.1)
