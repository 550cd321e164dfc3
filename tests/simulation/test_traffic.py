"""The sensor's vehicle, and cars and pedestrians along, against and across a street."""

from itertools import combinations, pairwise

import numpy as np
import pytest

from derain.errors import InputError
from derain.simulation.classes import TrackClass
from derain.simulation.sensor import Sensor
from derain.simulation.street import Street
from derain.simulation.traffic import DRIVING, WALKING, Course, MovingThing, draw_traffic

SENSOR = Sensor()
TIMES = np.arange(20) / 10


def turned(pose: np.ndarray) -> float:
    """The angle of a rotation, degrees."""
    cosine = (np.trace(pose[:3, :3]) - 1) / 2
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))


@pytest.mark.parametrize("seed", range(3))
def test_the_sensor_goes_along_the_street_at_its_speed_and_sways_a_little(seed: int) -> None:
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


def test_a_vehicle_that_stands_does_not_sway() -> None:
    course = Course.draw(0, np.random.default_rng(0))
    first = course.pose(0, SENSOR)
    assert first[:3, 3] == pytest.approx((0, 0, SENSOR.mounting_height))
    assert np.array_equal(course.pose(7.3, SENSOR), first)


def drawn(seed: int, count: int = 10, speed: float = 13.0) -> tuple[Street, list[MovingThing]]:
    generator = np.random.default_rng(seed)
    street = Street.draw(speed * TIMES[-1], generator)
    return street, draw_traffic(count, street, speed, TIMES, generator)


def corners(thing: MovingThing, time: float) -> np.ndarray:
    """Where it is seen from above, float64 (K, 2)."""
    return thing.surface.triangles[..., :2].reshape(-1, 2) + time * thing.velocity


@pytest.mark.parametrize("seed", range(3))
def test_cars_drive_and_pedestrians_walk_along_against_and_across_the_street(seed: int) -> None:
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
            y = corners(thing, 0)[:, 1].mean()
            assert np.sign(y - street.axis) == -np.sign(thing.velocity[0])
        # Everybody comes near the sensor.
        paths = [corners(thing, time) - (13 * time, 0) for time in TIMES]
        assert min(np.linalg.norm(path, axis=1).min() for path in paths) < 90


@pytest.mark.parametrize("speed", [0.0, 13.0])
def test_nobody_runs_into_anybody_else_or_into_the_sensor(speed: float) -> None:
    _, things = drawn(2, 15, speed)
    for time in TIMES:
        places = [corners(thing, time) for thing in things]
        sensor = np.array([[speed * time - 2.0, -0.8], [speed * time + 2.0, 0.8]])
        bounds = [(place.min(0), place.max(0)) for place in [*places, sensor]]
        for (low, high), (least, greatest) in combinations(bounds, 2):
            assert np.maximum(low - greatest, least - high).max() > 0.5


def test_a_street_with_no_room_left_is_reported() -> None:
    with pytest.raises(InputError, match=r"traffic: .* 100\. Give \d+ or"):
        drawn(0, 100)
