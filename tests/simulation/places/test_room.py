"""Rooms, as they are laid out and as a sensor in them sees them."""

from functools import cache
from types import ModuleType

import numpy as np

from derain.simulation.classes import TrackClass
from derain.simulation.places.room import MOUNTING_HEIGHTS, ROOM_CLEARANCE, lay_out_room
from derain.simulation.sensor import Returns, Sensor
from derain.simulation.track import Track

SEEDS = range(12)
SENSORS = [
    Sensor(azimuth=(-180, 180), inclination=(-89, 89), rows=60, columns=240, mounting_height=height)
    for height in MOUNTING_HEIGHTS
]


@cache
def room(seed: int) -> Track:
    return lay_out_room(np.random.default_rng(seed))


@cache
def seen(seed: int, which: int) -> Returns:
    return room(seed).cast(SENSORS[which])


def test_nothing_but_the_floor_and_the_ceiling_is_at_the_sensor(open3d: ModuleType) -> None:
    for seed in SEEDS:
        for which, sensor in enumerate(SENSORS):
            returns = seen(seed, which)
            ends = sensor.beams() * returns.range[:, None]
            level = returns.returned & (np.abs(ends[:, 2]) < 0.2)
            assert np.hypot(ends[level, 0], ends[level, 1]).min() > ROOM_CLEARANCE - 0.01
            assert returns.range.min() > 0.2


def test_walls_floor_and_ceiling_close_a_room_but_for_its_windows(open3d: ModuleType) -> None:
    shares = [seen(seed, 1).returned.mean() for seed in SEEDS]
    assert np.min(shares) > 0.7
    assert np.median(shares) > 0.9
    assert np.max(shares) == 1


def test_most_of_a_room_is_near_and_somebody_is_in_it(open3d: ModuleType) -> None:
    near, people = [], []
    for seed in SEEDS:
        returns = seen(seed, 1)
        near.append(np.median(returns.range[returns.returned]))
        people.append(returns.range[returns.label == TrackClass.PEDESTRIAN])
    assert np.median(near) < 4
    distance = np.concatenate(people)
    assert distance.min() < 1.5
    assert distance.max() > 3


def test_the_origin_is_on_the_floor(open3d: ModuleType) -> None:
    for seed in SEEDS:
        for which, sensor in enumerate(SENSORS):
            lowest = seen(seed, which).range[-240:]
            assert abs(np.median(lowest) - sensor.mounting_height) < 0.25
