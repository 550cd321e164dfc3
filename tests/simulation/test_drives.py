"""Streets that a sensor drives along, what moves in them, and what the sensor sees of it."""

from dataclasses import replace
from itertools import combinations, pairwise

import numpy as np
import pytest

from derain.errors import InputError
from derain.simulation.campaign import Campaign, Drive
from derain.simulation.classes import TrackClass, unpacked
from derain.simulation.scene import SimulatedScene
from derain.simulation.sensor import Sensor
from derain.simulation.street import SIGHT, STEP, Street, lay_out_street
from derain.simulation.track import Track
from derain.simulation.traffic import DRIVING, WALKING, Course, MovingThing, draw_traffic

pytestmark = pytest.mark.usefixtures("open3d")

# A little over what is stepped or driven on, and the roof of a van, metres.
LOWEST, HIGHEST = STEP + 0.05, 2.2

SENSOR = Sensor(rows=32, columns=200)
SCAN_TIMES = np.array([0.0, 0.1, 0.7])
TIMES = np.arange(20) / 10


@pytest.mark.parametrize(("seed", "length"), [(0, 20.0), (1, 0.0), (2, 30.0)])
def test_things_stand_on_both_sides_of_a_street_all_along_and_nothing_in_the_lanes(
    seed, length
) -> None:
    generator = np.random.default_rng(seed)
    street = Street.draw(length, generator)
    surfaces = list(lay_out_street(street, generator))
    labels = {surface.label for surface in surfaces}
    assert labels == set(TrackClass) - {TrackClass.RAIN, TrackClass.SPRINKLER, TrackClass.TARGET}
    corners = np.concatenate([surface.triangles.reshape(-1, 3) for surface in surfaces])
    # At heights at which a vehicle is.
    corners = corners[(corners[:, 2] > LOWEST) & (corners[:, 2] < HIGHEST)]
    aside = corners[:, 1] - street.axis
    assert np.abs(aside).min() > street.lane - 0.05  # but for the tip of a leaf
    for middle in street.junctions:
        assert np.abs(corners[:, 0] - middle).min() > street.lane
    for near in ((aside > -15) & (aside < 0), (aside < 15) & (aside > 0)):
        for begin in np.arange(-SIGHT, length + SIGHT - 30, 10):
            assert ((corners[near, 0] > begin) & (corners[near, 0] < begin + 30)).any()
    assert corners[:, 0].min() < -SIGHT + 20
    assert corners[:, 0].max() > length + SIGHT - 20


def turned(pose: np.ndarray) -> float:
    """The angle of a rotation, degrees."""
    cosine = (np.trace(pose[:3, :3]) - 1) / 2
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))


@pytest.mark.parametrize("seed", range(3))
def test_the_sensor_goes_along_the_street_at_its_speed_and_sways_a_little(seed) -> None:
    course = Course.draw(13, np.random.default_rng(seed))
    poses = np.array([course.pose(time, SENSOR) for time in np.arange(0, 5, 0.1)])
    rotation, places = poses[:, :3, :3], poses[:, :3, 3]
    assert np.allclose(rotation @ rotation.swapaxes(1, 2), np.eye(3), atol=1e-12)
    assert np.allclose(np.linalg.det(rotation), 1)
    # What is mounted on top sways with the roll and the pitch of the vehicle.
    assert np.allclose(places[:, 0], 1.3 * np.arange(50), atol=0.05)
    assert np.abs(places[:, 1]).max() < 0.3
    assert np.abs(places[:, 2] - SENSOR.mounting_height).max() < 0.1
    turns = [turned(np.linalg.inv(before) @ after) for before, after in pairwise(poses)]
    assert 0.02 < max(turns) < 2
    assert turned(poses[0]) < 6
    standing = Course.draw(0, np.random.default_rng(seed))
    assert np.array_equal(standing.pose(7.3, SENSOR), standing.pose(0, SENSOR))


def drawn(seed: int, count: int = 10, speed: float = 13.0) -> tuple[Street, list[MovingThing]]:
    generator = np.random.default_rng(seed)
    street = Street.draw(speed * TIMES[-1], generator)
    return street, draw_traffic(count, street, speed, TIMES, generator)


def moved(thing: MovingThing, time: float) -> np.ndarray:
    """Its triangles so many seconds after the first scan, float64 (T, 3, 3)."""
    return thing.surface.triangles + np.append(time * thing.velocity, 0)


@pytest.mark.parametrize("seed", range(3))
def test_cars_drive_and_pedestrians_walk_along_against_and_across_the_street(seed) -> None:
    street, things = drawn(seed)
    kinds = {(thing.surface.label, bool(abs(thing.velocity[1]) > 1e-6)) for thing in things}
    both = TrackClass.CAR, TrackClass.PEDESTRIAN
    assert kinds == {(kind, across) for kind in both for across in (False, True)}
    assert {np.sign(thing.velocity[0].round(6)) for thing in things} == {-1, 0, 1}
    for thing in things:
        car = thing.surface.label == TrackClass.CAR
        slowest, fastest = DRIVING if car else WALKING
        assert slowest <= np.linalg.norm(thing.velocity) <= fastest
        if car and abs(thing.velocity[0]) > 1:  # on the right of the street
            y = moved(thing, 0)[..., 1].mean()
            assert np.sign(y - street.axis) == -np.sign(thing.velocity[0])
        # Everybody comes near the sensor.
        paths = [moved(thing, time)[..., :2] - (13 * time, 0) for time in TIMES]
        assert min(np.linalg.norm(path, axis=-1).min() for path in paths) < 90


@pytest.mark.parametrize("speed", [0.0, 13.0])
def test_nobody_runs_into_anybody_else_or_into_the_sensor(speed) -> None:
    _, things = drawn(2, 15, speed)
    for time in TIMES:
        places = [moved(thing, time)[..., :2].reshape(-1, 2) for thing in things]
        sensor = np.array([[speed * time - 2.0, -0.8], [speed * time + 2.0, 0.8]])
        bounds = [(place.min(0), place.max(0)) for place in [*places, sensor]]
        for (low, high), (least, greatest) in combinations(bounds, 2):
            assert np.maximum(low - greatest, least - high).max() > 0.5


def test_a_street_with_no_room_left_is_reported() -> None:
    with pytest.raises(InputError, match=r"traffic: .* 100\. Give \d+ or"):
        drawn(0, 100)


def scene(campaign: Campaign) -> SimulatedScene:
    return SimulatedScene.of(campaign, "001", np.random.default_rng(0))


def test_what_moves_is_seen_as_if_it_were_built_into_the_street_with_its_number_on_it() -> None:
    drive = scene(Campaign(scans=3, sensor=SENSOR, drive=Drive(speed=13, traffic=7)))
    numbers = set()
    for time, returns in zip(SCAN_TIMES, drive.cast(SENSOR, SCAN_TIMES), strict=True):
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
        ends = SENSOR.beams() * returns.range[:, None] @ pose[:3, :3].T + pose[:3, 3]
        for row, thing in enumerate(drive.traffic, 1):
            corners = moved(thing, time).reshape(-1, 3)
            inside = ((ends > corners.min(0) - 2e-3) & (ends < corners.max(0) + 2e-3)).all(1)
            assert inside[number == row].all()
            assert (number[inside & returns.returned & (kind == thing.surface.label)] == row).all()
    assert {0} < numbers <= set(range(8))


@pytest.mark.parametrize("speed", [0.0, 13.0])
def test_a_skewed_scan_is_each_beam_of_the_scene_at_its_own_time(speed) -> None:
    sensor = Sensor(rows=16, columns=50, frame_rate=2)
    straight = scene(Campaign(scans=2, sensor=sensor, drive=Drive(speed, traffic=7)))
    (skewed,) = replace(straight, skew=True).cast(sensor, SCAN_TIMES[1:2])
    for column in (0, 20, 49):
        moment = SCAN_TIMES[1] + column / 50 / sensor.frame_rate
        (expected,) = straight.cast(sensor, np.array([moment]))
        beams = np.arange(column, 16 * 50, 50)
        assert np.allclose(skewed.range[beams], expected.range[beams], rtol=1e-6)
        assert np.array_equal(skewed.label[beams], expected.label[beams])
    (at_once,) = straight.cast(sensor, SCAN_TIMES[1:2])
    assert not np.allclose(skewed.range, at_once.range, atol=0.1)
