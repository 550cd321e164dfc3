"""The weather of a scene, and what a sensor sees of one in which it, and others, move."""

import math
from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest

from derain.simulation import shapes
from derain.simulation.campaign import Campaign, Drive
from derain.simulation.classes import TrackClass, unpacked
from derain.simulation.objects import Surface
from derain.simulation.rain_field import UniformRain, slope
from derain.simulation.scene import STRONGEST_WIND, SimulatedScene, Weather, draw_wind
from derain.simulation.sensor import Returns, Sensor
from derain.simulation.track import Track
from derain.simulation.traffic import Course, MovingThing

SENSOR = Sensor(rows=32, columns=200)
TIMES = np.array([0.0, 0.1, 0.7])
DRIVING = Campaign(scans=3, sensor=SENSOR, drive=Drive(speed=13, traffic=7))


def scene(campaign: Campaign) -> SimulatedScene:
    return SimulatedScene.of(campaign, "001", np.random.default_rng(0))


def points(returns: Returns, pose: np.ndarray) -> np.ndarray:
    """Where the beams end in the scene, float64 (N, 3)."""
    return (SENSOR.beams() * returns.range[:, None]) @ pose[:3, :3].T + pose[:3, 3]


def moved(thing: MovingThing, time: float) -> np.ndarray:
    """Its triangles so many seconds after the first scan, float64 (T, 3, 3)."""
    return thing.surface.triangles + np.append(time * thing.velocity, 0)


@pytest.mark.parametrize(("rate", "visibility"), [(10.0, 2514), (25.0, 1412), (50.0, 912)])
def test_the_record_has_koschmieders_visibility_and_the_median_drop_by_volume(
    rate: float, visibility: float
) -> None:
    weather = Weather.of(rate, 9.0, (0.0, 2.0))
    # Extinction of 1.556, 2.771 and 4.288 per km.
    assert weather.visibility_m == pytest.approx(visibility, rel=1e-3)
    diameter = np.linspace(0, 40, 400_001)
    water = np.cumsum(diameter**3 * np.exp(-float(slope(rate)) * diameter))
    median = diameter[np.searchsorted(water, water[-1] / 2)]
    assert weather.median_volume_diameter_mm == pytest.approx(median, 1e-3)
    assert (weather.wind_speed_m_s, weather.wind_direction_deg) == (2.0, 90.0)


def test_clear_air_has_no_drops_and_no_end_to_its_visibility_and_winds_are_weak() -> None:
    clear = Weather.of(0.0, 0.0, (0, 0))
    assert clear.median_volume_diameter_mm == 0
    assert clear.drop_slope_per_mm == clear.visibility_m == math.inf
    winds = [draw_wind(np.random.default_rng(seed)) for seed in range(50)]
    assert 0.9 * STRONGEST_WIND < np.abs(winds).max() <= STRONGEST_WIND


def test_walls_and_ground_stay_where_they_are_by_the_poses(open3d: ModuleType) -> None:
    surfaces = [
        Surface(shapes.box(1, 200, -1, 60, at=(50.5, 0)), TrackClass.TARGET, 0.5),
        Surface(shapes.box(400, 1, -1, 60, at=(0, 8.5)), TrackClass.CAR, 0.5),
        Surface(shapes.rectangle((-300, 300), (-300, 300), 0), TrackClass.ROAD, 0.5),
    ]
    weather, course = Weather.of(0.0, 0.0, (0.0, 0.0)), Course.draw(13, np.random.default_rng(3))
    seen = SimulatedScene(Track.of(surfaces), UniformRain(0), weather, course).cast(SENSOR, TIMES)
    for time, returns in zip(TIMES, seen, strict=True):
        ends = points(returns, course.pose(time, SENSOR))
        for kind, axis, place in (("TARGET", 0, 50), ("CAR", 1, 8), ("ROAD", 2, 0)):
            hit = returns.returned & (returns.label == TrackClass[kind])
            assert hit.sum() > 100
            assert np.allclose(ends[hit, axis], place, atol=2e-3)


def test_what_moves_is_seen_as_if_it_were_built_into_the_street_with_its_number_on_it(
    open3d: ModuleType,
) -> None:
    drive = scene(DRIVING)
    numbers = set()
    for time, returns in zip(TIMES, drive.cast(SENSOR, TIMES), strict=True):
        pose = drive.course.pose(time, SENSOR)
        moving = Track.of(
            replace(thing.surface, triangles=moved(thing, time)) for thing in drive.traffic
        )
        expected = Track.joined([drive.track, moving]).cast(SENSOR, pose)
        assert np.allclose(returns.range, expected.range, rtol=1e-5)
        assert np.allclose(returns.reflectivity, expected.reflectivity, atol=1e-5)
        kind, number = unpacked(returns.label)
        assert np.array_equal(kind, expected.label)
        assert np.array_equal(returns.beam, expected.beam)
        numbers |= set(number)
        ends = points(returns, pose)
        for row, thing in enumerate(drive.traffic, 1):
            corners = moved(thing, time).reshape(-1, 3)
            inside = ((ends > corners.min(0) - 2e-3) & (ends < corners.max(0) + 2e-3)).all(1)
            assert inside[number == row].all()
            assert (kind[number == row] == thing.surface.label).all()
            assert (number[inside & returns.returned & (kind == thing.surface.label)] == row).all()
    assert {0} < numbers <= set(range(8))


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
