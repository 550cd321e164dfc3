"""The training world: what places, sensors and precipitation of a scan are drawn from."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Self

from numpy.random import Generator

from derain.errors import InputError
from derain.files.documents import Entry, shown
from derain.files.packaged import packaged, packaged_or_own
from derain.scan import Scan
from derain.simulation.classes import TrackClass
from derain.simulation.drawn_sensor import draw_sensor
from derain.simulation.flying.kinds import PrecipitationSpans, draw_precipitation
from derain.simulation.flying.meeting import meet
from derain.simulation.flying.precipitation import Precipitation
from derain.simulation.layouts import INDOORS, LAYOUTS
from derain.simulation.places.carrier import lay_out_carrier
from derain.simulation.places.horizon import lay_out_horizon
from derain.simulation.sensor import Sensor
from derain.simulation.sensor_file import read_fields
from derain.simulation.spans import SensorSpans, draw_kind
from derain.simulation.track import Track

# A scan with fewer points teaches nothing, and one with a greater share of rain shows weather that
# no sensor is used in: both are drawn again, at most so many times before the world is refused.
SMALLEST_SCAN = 1000
LARGEST_SHARE_OF_RAIN = 0.4
MOST_TRIES = 100


@dataclass(frozen=True)
class World:
    """The distributions that scans are drawn from.

    Attributes:
        places: Weight of each layout, by its name in ``LAYOUTS``; the default is all of them alike.
        horizon: Share of the places outdoors that go on to where only few beams reach.
        carrier: Share of the sensors that see what carries them.
        sensors: What sensors are drawn from.
        precipitation: What precipitation is drawn from.

    Raises:
        InputError: Weights of which none is above 0, or a share outside 0 to 1.
    """

    places: Mapping[str, float] = field(default_factory=lambda: dict.fromkeys(LAYOUTS, 1.0))
    horizon: float = 0.7
    carrier: float = 1.0
    sensors: SensorSpans = field(default_factory=SensorSpans)
    precipitation: PrecipitationSpans = field(default_factory=PrecipitationSpans)

    def __post_init__(self) -> None:
        for place, weight in self.places.items():
            if not 0 <= weight < math.inf:
                reason = f"{shown(weight)} is no weight"
                raise InputError(f"world: places: {place}", reason, "Give 0 or more.")
        if not any(self.places.values()):
            raise InputError("world: places", "no place has a weight", "Give one place a weight.")
        for name in ("horizon", "carrier"):
            share = getattr(self, name)
            if not 0 <= share <= 1:
                reason = f"{shown(share)} is no share"
                raise InputError(f"world: {name}", reason, "Give a share of 0 to 1.")

    @classmethod
    def of(cls, entry: Entry) -> Self:
        """Reads what a document states; the rest is as by default.

        Raises:
            InputError: Another key, or a value of another kind or that is impossible.
        """
        parsers = {
            "places": _weights_of_places,
            "horizon": lambda part: part.within(0, 1),
            "carrier": lambda part: part.within(0, 1),
            "sensors": SensorSpans.of,
            "precipitation": PrecipitationSpans.of,
        }
        return read_fields(cls, entry, parsers)


@dataclass(frozen=True, eq=False)
class DrawnScan:
    """A scan of a world.

    Attributes:
        scan: Its points, intensities in 0..255, and labels, which are TrackClass.
        place: Name of the layout.
        sensor: The sensor that took it.
        precipitation: What flew in it.
    """

    scan: Scan
    place: str
    sensor: Sensor
    precipitation: Precipitation

    @property
    def description(self) -> dict[str, Any]:
        """What was drawn, in primitives."""
        sensor, precipitation = asdict(self.sensor), asdict(self.precipitation)
        return {"place": self.place, "sensor": sensor, "precipitation": precipitation}


def packaged_worlds() -> dict[str, Path]:
    """Files of the worlds that come with derain, by name."""
    return packaged("derain.simulation", "worlds")


def load_world(name: str | Path) -> World:
    """Reads a world.

    Args:
        name: Name of a packaged world, or a YAML file with attributes of :class:`World`.

    Raises:
        InputError: No such world, or a file that does not describe one.
    """
    return World.of(Entry.of_yaml(packaged_or_own(name, packaged_worlds(), "world")))


def draw_scan(world: World, generator: Generator) -> DrawnScan:
    """Draws a place, a sensor and the weather, and takes a scan.

    Args:
        world: What is drawn from.
        generator: Random generator.

    Raises:
        InputError: A world of which hardly a scan holds anything but rain, or Open3D cannot be
            imported.
    """
    for _ in range(MOST_TRIES):
        drawn = _drawn(world, generator)
        kind = drawn.scan.label
        assert kind is not None  # a simulated scan is labelled
        if len(kind) >= SMALLEST_SCAN and (kind == TrackClass.RAIN).mean() <= LARGEST_SHARE_OF_RAIN:
            return drawn
    raise InputError("world", "its scans are empty or nothing but rain", "Draw less rain.")


def _drawn(world: World, generator: Generator) -> DrawnScan:
    sensor = draw_sensor(world.sensors, generator)
    place = draw_kind(world.places, generator)
    track = _laid_out(place, world, sensor, generator)
    precipitation = draw_precipitation(world.precipitation, generator)
    detected = meet(track.cast(sensor), sensor.beams(), precipitation, sensor, generator)
    return DrawnScan(sensor.measure(detected, generator), place, sensor, precipitation)


def _laid_out(place: str, world: World, sensor: Sensor, generator: Generator) -> Track:
    track = LAYOUTS[place](generator)
    if place not in INDOORS and generator.random() < world.horizon:
        track = track.with_surfaces(lay_out_horizon(generator))
    if generator.random() < world.carrier:
        track = track.with_surfaces(lay_out_carrier(generator, sensor.mounting_height))
    return track


def _weights_of_places(entry: Entry) -> dict[str, float]:
    return dict(entry.record(dict.fromkeys(LAYOUTS, Entry.number)))
