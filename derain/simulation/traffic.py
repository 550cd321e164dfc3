"""Moving objects of a sequence: the sensor's vehicle, cars, and people who walk."""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from derain.errors import InputError
from derain.files.extrinsics import POSE, motion_of_pose
from derain.scan import Floats
from derain.simulation import objects
from derain.simulation.objects import Surface
from derain.simulation.sensor import Sensor
from derain.simulation.street import KERB, PAVEMENT, Street

# How far a vehicle strays from steady driving at full sway, metres and degrees: each is the
# amplitude of one of two waves. Modelling choices, with the frequencies: on an even road a car
# pitches and rolls by some tenths of a degree at one to two hertz, and is steered more slowly.
SWAY = {"x": 0.0, "y": 0.1, "z": 0.015, "roll": 0.3, "pitch": 0.2, "yaw": 0.4}
FREQUENCIES = {
    **dict.fromkeys(("x", "y", "yaw"), (0.1, 0.6)),
    **dict.fromkeys(("z", "roll", "pitch"), (0.8, 2.0)),
}
WAVES = 2

# From this speed on a vehicle sways in full, m/s; one that stands does not sway.
SPEED_OF_FULL_SWAY = 5.0

# By how much a sensor may be mounted out of level, and turned off the street, degrees.
MOUNTING = {"roll": 1.5, "pitch": 2.0, "yaw": 3.0}


@dataclass(frozen=True, eq=False)
class Course:
    """The motion of a vehicle through a scene, whose x axis is the street.

    Attributes:
        speed: Along x, m/s.
        amplitude: Of each wave of each of x, y, z, roll, pitch, yaw: float64 (6, WAVES), metres
            and degrees.
        frequency: Likewise, Hz.
        phase: Likewise, radians.
        mounting: Turns from the sensor's frame into the vehicle's, float64 (4, 4).
    """

    speed: float
    amplitude: Floats
    frequency: Floats
    phase: Floats
    mounting: Floats

    @classmethod
    def draw(cls, speed: float, generator: Generator) -> "Course":
        """Draws a course at a speed in m/s."""
        sway = min(1.0, speed / SPEED_OF_FULL_SWAY)
        shape = (len(POSE), WAVES)
        greatest = sway * np.array([SWAY[name] for name in POSE])[:, None]
        slowest, fastest = np.array([FREQUENCIES[name] for name in POSE]).T[:, :, None]
        turns = {name: generator.uniform(-most, most) for name, most in MOUNTING.items()}
        return cls(
            speed,
            greatest * generator.uniform(0.5, 1, shape),
            generator.uniform(slowest, fastest, shape),
            generator.uniform(0, 2 * np.pi, shape),
            motion_of_pose(0, 0, 0, **turns),
        )

    def pose(self, time: float, sensor: Sensor) -> Floats:
        """Takes points from the frame of a sensor on the vehicle into the scene's.

        Args:
            time: Seconds since the first scan.
            sensor: The sensor; it is mounted at its height above the origin of the vehicle.

        Returns:
            float64 (4, 4), metres.
        """
        waves = self.amplitude * np.sin(2 * np.pi * self.frequency * time + self.phase)
        place = dict(zip(POSE, waves.sum(axis=1), strict=True))
        place["x"] += self.speed * time
        vehicle = motion_of_pose(**place)
        above = motion_of_pose(0, 0, sensor.mounting_height, 0, 0, 0)
        return np.asarray(vehicle @ above @ self.mounting)


# How fast vehicles drive and people walk, m/s.
DRIVING = (3.0, 15.0)
WALKING = (0.8, 2.0)

# What the vehicle that carries the sensor takes up ahead of the sensor, behind it and on either
# side, metres.
VEHICLE = np.array([[-3.0, -1.0], [2.5, 1.0]])

# Free space between any two things that move, metres, and how often a place is looked for.
KEPT_APART = 0.7
TRIES = 500


@dataclass(frozen=True, eq=False)
class MovingThing:
    """Something that moves at a steady speed.

    Attributes:
        surface: Its place at the first scan.
        velocity: Along x and y, float64 (2,), m/s.
    """

    surface: Surface
    velocity: Floats

    def bounds(self, times: Floats) -> Floats:
        """Its least and greatest x and y at some times, float64 (T, 2, 2), metres."""
        corners = self.surface.triangles[..., :2].reshape(-1, 2)
        box = np.stack([corners.min(axis=0), corners.max(axis=0)])
        return np.asarray(box + (times[:, None] * self.velocity)[:, None, :])


def draw_traffic(
    count: int, street: Street, speed: float, times: Floats, generator: Generator
) -> list[MovingThing]:
    """Draws the cars and pedestrians that move in a street.

    In turn: a car in the sensor's lane, an oncoming one, somebody who walks along a pavement, a car
    that crosses at a junction, somebody who crosses there on foot. Each is near the sensor at some
    moment of the drive, and none comes too near another or the sensor's vehicle at any scan.

    Args:
        count: Their number.
        street: The street.
        speed: Of the sensor, m/s.
        times: Times of the scans, float64 (T,), seconds from 0 on.
        generator: Random generator.

    Raises:
        InputError: There is no room for this number.
    """
    taken = [VEHICLE + np.stack([speed * times, 0 * times], axis=1)[:, None, :]]
    things = []
    for number in range(count):
        draw = WAYS[number % len(WAYS)]
        for _ in range(TRIES):
            time = generator.uniform(0, times[-1])
            surface, place, heading, pace = draw(street, speed * time, generator)
            velocity = pace * np.array([np.cos(heading), np.sin(heading)])
            x, y = place - time * velocity
            thing = MovingThing(surface.placed(x, y, heading), velocity)
            bounds = thing.bounds(times)
            if not any(_meet(bounds, other) for other in taken):
                break
        else:
            reason = f"the street has no room for {count}"
            raise InputError("traffic", reason, f"Give {number} or fewer.")
        taken.append(bounds)
        things.append(thing)
    return things


def _meet(first: Floats, second: Floats) -> bool:
    """True if bounds, float64 (T, 2, 2) each, come nearer than the clearance at one time."""
    apart = (first[:, 0] > second[:, 1] + KEPT_APART) | (second[:, 0] > first[:, 1] + KEPT_APART)
    return bool((~apart.any(axis=1)).any())


# A thing, where it is when it is near the sensor, where it heads, radians, and its speed, m/s.
Way = tuple[Surface, tuple[float, float], float, float]


def _car_ahead(street: Street, x: float, generator: Generator) -> Way:
    # Three of four are ahead, where every sensor looks.
    away = generator.uniform(8, 45) * generator.choice([1, -1], p=[0.75, 0.25])
    place = x + away, generator.uniform(-0.3, 0.3)
    return objects.car(generator), place, 0, generator.uniform(*DRIVING)


def _car_oncoming(street: Street, x: float, generator: Generator) -> Way:
    place = x + generator.uniform(-5, 45), street.lane + generator.uniform(-0.3, 0.3)
    return objects.car(generator), place, np.pi, generator.uniform(*DRIVING)


def _walker(street: Street, x: float, generator: Generator) -> Way:
    side, heading = generator.choice([-1, 1]), np.pi * generator.integers(2)
    y = street.beside(side, generator.uniform(KERB + 0.5, PAVEMENT - 0.4))
    place, pace = (x + generator.uniform(-5, 35), y), generator.uniform(*WALKING)
    return objects.pedestrian(generator), place, heading, pace


def _car_crossing(street: Street, x: float, generator: Generator) -> Way:
    way = generator.choice([-1, 1])  # to the left or to the right, on the right of its street
    x = _junction(street, x, generator) + way * street.lane / 2
    place, speed = (x, generator.uniform(-12, 12)), generator.uniform(*DRIVING)
    return objects.car(generator), place, way * np.pi / 2, speed


def _walker_crossing(street: Street, x: float, generator: Generator) -> Way:
    way, edge = generator.choice([-1, 1]), generator.choice([-1, 1])
    x = _junction(street, x, generator) + edge * (street.lane + generator.uniform(0.5, 2))
    place = x, street.axis + generator.uniform(-1, 1) * street.lane
    pace = generator.uniform(*WALKING)
    return objects.pedestrian(generator), place, way * np.pi / 2, pace


def _junction(street: Street, x: float, generator: Generator) -> float:
    """One of the two junctions nearest to a place 15 m ahead of the sensor, metres along x."""
    distance = np.abs(np.array(street.junctions) - x - 15)
    nearest = np.argsort(distance)[: generator.integers(1, 3)]
    return street.junctions[int(nearest[-1])]


# Ways to move near the sensor, by where it is then, metres along x.
WAYS = (_car_ahead, _car_oncoming, _walker, _car_crossing, _walker_crossing)
