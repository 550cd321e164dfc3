"""The scene of a sequence: its weather, and what a sensor sees of it in each scan."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import repeat

import numpy as np
from numpy.random import Generator

from derain.scan import Floats
from derain.simulation.campaign import Campaign
from derain.simulation.classes import packed
from derain.simulation.layouts import LAYOUTS
from derain.simulation.objects import Surface
from derain.simulation.rain_field import RainField, SprinkledRain, UniformRain, weather_record
from derain.simulation.sensor import Returns, Sensor
from derain.simulation.shapes import Place
from derain.simulation.street import Street, lay_out_street
from derain.simulation.track import Track
from derain.simulation.traffic import Course, MovingThing, draw_traffic

# Strongest mean wind along each axis, m/s, a modelling choice: a light breeze, for in more the
# facility's rain would not come down on its track.
STRONGEST_WIND = 2.0


@dataclass(frozen=True, eq=False)
class SimulatedScene:
    """A place, the rain on it and the weather; and what moves in it.

    Attributes:
        track: The track at rest.
        rain: The rain; it is the same wherever the sensor is.
        weather: The record of it, see :func:`derain.simulation.rain_field.weather_record`.
        course: Motion of the sensor; None for a sensor at rest at the origin of the track.
        traffic: Other moving objects.
        skew: True if they move on while a scan is taken, see :class:`Drive`.
    """

    track: Track
    rain: RainField
    weather: dict[str, float]
    course: Course | None = None
    traffic: Sequence[MovingThing] = ()
    skew: bool = False

    @classmethod
    def of(cls, campaign: Campaign, name: str, generator: Generator) -> "SimulatedScene":
        """Draws the scene of a sequence.

        Raises:
            InputError: A street without room for so much traffic.
        """
        nominal, wind = campaign.rain_rate[name], draw_wind(generator)
        sprinkled = campaign.layout == "facility" and nominal > 0
        rain = SprinkledRain(nominal, wind) if sprinkled else UniformRain(nominal)
        at_sensor = float(rain.rate(np.zeros(1), np.zeros(1))[0])
        weather = weather_record(nominal, at_sensor, wind)
        if campaign.drive is None:
            return cls(LAYOUTS[campaign.layout](generator), rain, weather)
        drive, times = campaign.drive, campaign.times
        street = Street.draw(drive.speed * times[-1], generator)
        course = Course.draw(drive.speed, generator)
        traffic = draw_traffic(drive.traffic, street, drive.speed, times, generator)
        track = Track.of(lay_out_street(street, generator))
        return cls(track, rain, weather, course, traffic, drive.skew)

    def cast(self, sensor: Sensor, times: Floats) -> Iterator[Returns]:
        """The return of every beam of a sensor through clear air, scan after scan.

        Args:
            sensor: The sensor.
            times: Start times of the scans, float64 (T,), seconds.

        Yields:
            As :meth:`Track.cast`; labels have the number of what moves in their upper 16 bits.

        Raises:
            InputError: Open3D cannot be imported.
        """
        if self.course is None:
            yield from repeat(self.track.cast(sensor), len(times))
            return
        numbered = enumerate(self.traffic, 1)
        things = [(_numbered(number, thing.surface), thing.velocity) for number, thing in numbered]
        for time in times:
            sent, pose = self._moments(self.course, time, sensor)
            seen = self.track.cast(sensor, pose)
            for thing, velocity in things:
                seen = _nearer(seen, thing.cast(sensor, _followed(pose, sent, velocity)))
            yield seen

    def _moments(self, course: Course, time: float, sensor: Sensor) -> tuple[Floats, Floats]:
        """Times of the beams of a scan, and the sensor's pose then: of all at once, or each.

        Returns:
            Seconds, float64 () or (N,); and poses, float64 (4, 4) or (N, 4, 4).
        """
        if not self.skew:
            return np.array(time), course.pose(time, sensor)
        sent, beam = np.unique(time + sensor.beam_times(), return_inverse=True)
        return sent[beam], np.stack([course.pose(moment, sensor) for moment in sent])[beam]


def _numbered(number: int, surface: Surface) -> Track:
    """A track of one thing that moves, where it is at the first scan, labelled with its number."""
    track = Track.of([surface])
    return replace(track, label=packed(track.label, number))


def _followed(pose: Floats, sent: Floats, velocity: Floats) -> Floats:
    """Poses as seen from something that moves, which itself then stays where it is at time 0."""
    seen = pose.copy()
    seen[..., :2, 3] -= sent[..., None] * velocity
    return seen


def _nearer(first: Returns, second: Returns) -> Returns:
    """Of two returns of every beam the nearer."""
    rows = np.arange(len(first.beam))
    nearer = second.range < first.range
    return Returns.joined([first, second]).take(rows + len(rows) * nearer)


def draw_wind(generator: Generator) -> Place:
    """Draws a wind: its velocity towards x (ahead) and y (left), m/s."""
    ahead, left = generator.uniform(-STRONGEST_WIND, STRONGEST_WIND, 2)
    return float(ahead), float(left)
