"""What a drive may be."""

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from derain.errors import InputError
from derain.simulation.drive import LONGEST, Course, Drive
from derain.simulation.sensor import Sensor


def test_a_drive_is_as_long_as_its_speed_takes_it() -> None:
    assert Drive(speed=13).length(0.5) == 6.5
    assert Drive(traffic=3).length(1e6) == 0


def test_a_drive_longer_than_any_street_is_refused() -> None:
    assert Drive(speed=10).length(LONGEST / 10) == LONGEST
    with pytest.raises(InputError, match="2,010 m"):
        Drive(speed=10).length(201)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"speed": -1.0}, "speed: -1.0 "),
        ({"speed": math.nan}, "speed: nan "),
        ({"speed": math.inf}, "speed: inf "),
        ({"skew": True}, "skew: "),
        ({"traffic": -1}, "traffic: -1 "),
        ({"traffic": 10**9}, "traffic: 1000000000 "),
    ],
)
def test_an_impossible_drive_is_refused(wrong: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Drive(**wrong)


SENSOR = Sensor()
SEEDS = range(5)


def turned(pose: np.ndarray) -> float:
    """The angle of a rotation, degrees."""
    cosine = (np.trace(pose[:3, :3]) - 1) / 2
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))


@pytest.mark.parametrize("seed", SEEDS)
def test_every_pose_is_a_rigid_motion(seed: int) -> None:
    course = Course.draw(13, np.random.default_rng(seed))
    for time in np.arange(0, 2, 0.1):
        pose = course.pose(time, SENSOR)
        assert np.allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-12)
        assert np.linalg.det(pose[:3, :3]) == pytest.approx(1)
        assert np.array_equal(pose[3], (0, 0, 0, 1))


@pytest.mark.parametrize("seed", SEEDS)
def test_the_sensor_goes_along_the_street_at_its_speed_and_sways_a_little(seed: int) -> None:
    course = Course.draw(13, np.random.default_rng(seed))
    poses = [course.pose(time, SENSOR) for time in np.arange(0, 5, 0.1)]
    places = np.array([pose[:3, 3] for pose in poses])
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
