"""A drive: its options, and the course of the vehicle that carries the sensor."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.random import Generator

from derain.errors import InputError
from derain.files.documents import shown
from derain.files.extrinsics import POSE, Extrinsics
from derain.simulation.arrays import Floats
from derain.simulation.sensor import Sensor

# Fastest vehicle, m/s: 216 km/h.
FASTEST = 60.0

# Most things that move. A street has room for 25 or more within sight of a sensor that stands.
MOST_TRAFFIC = 20

# Longest drive, metres: its street has one and a half million triangles and is laid out in 10 s.
LONGEST = 2000.0


@dataclass(frozen=True)
class Drive:
    """A drive along a street, or a stand in it while others move.

    Attributes:
        speed: Speed of the sensor along the street, m/s; 0 stands.
        traffic: How many cars and pedestrians move, each at a speed of its own.
        skew: Whether every beam sees the scene as it is when that beam is sent, so that a scan is
            skewed by what moves while it is taken; else all of a scan is seen as it is when the
            scan begins, as after a perfect correction.

    Raises:
        InputError: A speed or a number that is impossible, or skew where nothing moves.
    """

    speed: float = 0.0
    traffic: int = 0
    skew: bool = False

    def __post_init__(self) -> None:
        if not 0 <= self.speed <= FASTEST:
            raise InputError(
                "speed",
                f"{shown(self.speed)} m/s is impossible",
                f"Give 0 (stands) to {FASTEST:g}.",
            )
        if not 0 <= self.traffic <= MOST_TRAFFIC:
            raise InputError(
                "traffic", f"{shown(self.traffic)} is impossible", f"Give 0 to {MOST_TRAFFIC}."
            )
        if self.skew and not (self.speed or self.traffic):
            raise InputError(
                "skew", "there is none where nothing moves", "Give a speed or traffic."
            )

    def length(self, duration: float) -> float:
        """Length of the drive in metres.

        Args:
            duration: How long it takes, seconds.

        Raises:
            InputError: Too long a drive.
        """
        length = self.speed * duration
        if length > LONGEST:
            raise InputError(
                "drive",
                f"{duration:,.0f} s at {self.speed:g} m/s are {length:,.0f} m of street, more "
                f"than {LONGEST:,.0f}",
                "Simulate more sequences of fewer scans.",
            )
        return length


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
    def draw(cls, speed: float, generator: Generator) -> Self:
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
            Extrinsics.of_pose(0, 0, 0, **turns).matrix,
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
        vehicle = Extrinsics.of_pose(**place).matrix
        above = Extrinsics.of_pose(0, 0, sensor.mounting_height, 0, 0, 0).matrix
        return np.asarray(vehicle @ above @ self.mounting)
