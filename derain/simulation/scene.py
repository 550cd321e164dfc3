"""What a sequence is recorded of, and what a sensor sees of it scan after scan."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import repeat
from typing import Self

import numpy as np
from numpy.typing import NDArray

from derain.simulation.campaign import Campaign
from derain.simulation.classes import packed
from derain.simulation.course import Course
from derain.simulation.drive import Drive
from derain.simulation.facility import lay_out_facility
from derain.simulation.layout import lay_out_track
from derain.simulation.rain_field import RainField, SprinkledRain, UniformRain
from derain.simulation.sensor import Returns, Sensor
from derain.simulation.street import Street, lay_out_street
from derain.simulation.track import Track
from derain.simulation.traffic import MovingThing, draw_traffic
from derain.simulation.weather import Weather, draw_wind

LAYOUTS = {"street": lay_out_track, "facility": lay_out_facility}


@dataclass(frozen=True, eq=False)
class SimulatedScene:
    """A place, the rain on it and the weather; and what moves in it.

    All of a scan is seen from where the sensor is when it begins: neither the sensor nor anything
    else moves on until the next one. A recording of a spinning sensor is skewed by the way that it
    drives in a turn, where nobody has undone that.

    Attributes:
        track: What stands.
        rain: The rain; it is the same wherever the sensor is.
        weather: The record of it.
        course: How the sensor moves; None stands at the origin of the track.
        traffic: What else moves.
    """

    track: Track
    rain: RainField
    weather: Weather
    course: Course | None = None
    traffic: Sequence[MovingThing] = ()

    @classmethod
    def of(cls, campaign: Campaign, name: str, generator: np.random.Generator) -> Self:
        """Draws the scene of a sequence.

        Raises:
            InputError: A street without room for so much traffic.
        """
        nominal, wind = campaign.rain_rate[name], draw_wind(generator)
        sprinkled = campaign.layout == "facility" and nominal > 0
        rain = SprinkledRain(nominal, wind) if sprinkled else UniformRain(nominal)
        at_sensor = float(rain.rate(np.zeros(1), np.zeros(1))[0])
        weather = Weather.of(nominal, at_sensor, wind)
        if campaign.drive is None:
            return cls(LAYOUTS[campaign.layout](generator), rain, weather)
        course, track, traffic = _drawn(campaign.drive, campaign.times, generator)
        return cls(track, rain, weather, course, traffic)

    def cast(self, sensor: Sensor, times: NDArray[np.float64]) -> Iterator[Returns]:
        """What every beam of a sensor would return through clear air, scan after scan.

        Args:
            sensor: The sensor.
            times: When the scans begin, float64 (T,), seconds.

        Yields:
            As :meth:`Track.cast`; labels have the number of what moves in their upper 16 bits.

        Raises:
            InputError: Open3D cannot be imported.
        """
        if self.course is None:
            yield from repeat(self.track.cast(sensor), len(times))
            return
        for time in times:
            pose = self.course.pose(time, sensor)
            seen = self.track.cast(sensor, pose)
            if self.traffic:
                seen = _nearer(seen, self._moving(time).cast(sensor, pose))
            yield seen

    def _moving(self, time: float) -> Track:
        """What moves, where it is at a time. It is few triangles: what stands is not made anew."""
        surfaces = [thing.at(time) for thing in self.traffic]
        track = Track.of(surfaces)
        number = np.repeat(
            np.arange(1, len(surfaces) + 1), [len(surface.triangles) for surface in surfaces]
        )
        return Track(track.triangles, track.reflectivity, packed(track.label, number))


def _drawn(
    drive: Drive, times: NDArray[np.float64], generator: np.random.Generator
) -> tuple[Course, Track, list[MovingThing]]:
    street = Street.draw(drive.length(times[-1]), generator)
    course = Course.draw(drive.speed, generator)
    traffic = draw_traffic(drive.traffic, street, drive.speed, times, generator)
    return course, Track.of(lay_out_street(street, generator)), traffic


def _nearer(first: Returns, second: Returns) -> Returns:
    """Of two returns of every beam the nearer."""
    nearer = second.range < first.range
    return Returns(
        np.where(nearer, second.range, first.range),
        np.where(nearer, second.reflectivity, first.reflectivity),
        np.where(nearer, second.label, first.label),
        first.beam,
    )
