"""Rooms, as a sensor in them sees them."""

from types import ModuleType

import numpy as np

from derain.simulation.classes import TrackClass
from derain.simulation.places.room import MOUNTING_HEIGHTS, ROOM_CLEARANCE, lay_out_room
from derain.simulation.sensor import Sensor

SENSORS = [
    Sensor(azimuth=(-180, 180), inclination=(-89, 89), rows=60, columns=120, mounting_height=height)
    for height in MOUNTING_HEIGHTS
]


def test_a_room_is_closed_about_the_sensor_and_near_and_has_people_in_it(
    open3d: ModuleType,
) -> None:
    shares, near, people = [], [], []
    for seed in range(12):
        room = lay_out_room(np.random.default_rng(seed))
        for sensor in SENSORS:
            seen = room.cast(sensor)
            ends = sensor.beams() * seen.range[:, None]
            level = seen.returned & (np.abs(ends[:, 2]) < 0.2)
            assert np.hypot(ends[level, 0], ends[level, 1]).min() > ROOM_CLEARANCE - 0.01
            assert seen.range.min() > 0.2
            # The origin is on the floor.
            assert abs(np.median(seen.range[-120:]) - sensor.mounting_height) < 0.25
        shares.append(seen.returned.mean())
        near.append(np.median(seen.range[seen.returned]))
        people.append(seen.range[seen.label == TrackClass.PEDESTRIAN])
    assert np.min(shares) > 0.7  # through windows and glass
    assert np.median(shares) > 0.9
    assert np.max(shares) == 1
    assert np.median(near) < 4
    distance = np.concatenate(people)
    assert distance.min() < 1.5
    assert distance.max() > 3
