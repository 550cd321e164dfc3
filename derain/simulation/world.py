"""The training world: what scans are drawn from, and a data set of single scans drawn from one."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

import numpy as np
import yaml
from numpy.random import Generator

from derain.errors import InputError
from derain.files import write_scan
from derain.files.atomic import write_text
from derain.files.documents import Entry, packaged, packaged_or_own
from derain.files.labels import write_labels
from derain.scan import Scan
from derain.simulation.campaign import AtLeastOne, Count, SplitSequences
from derain.simulation.classes import TrackClass, unpacked
from derain.simulation.drawing import pick
from derain.simulation.drawn_sensor import SensorSpans, draw_sensor
from derain.simulation.flying.meeting import meet
from derain.simulation.flying.precipitation import KINDS, Kind, draw_precipitation, kinds_of
from derain.simulation.layouts import INDOORS, LAYOUTS
from derain.simulation.places.carrier import lay_out_carrier
from derain.simulation.places.horizon import lay_out_horizon
from derain.simulation.sensor import Sensor
from derain.simulation.sequence import FOLDERS
from derain.simulation.settings import Settings, Share, weights_of
from derain.simulation.track import Track

# Of each sequence.
STEM = "000000"
DRAWN_WORLDS = "drawn.yaml"

# A scan with fewer points teaches nothing, and one with a greater share of rain shows weather that
# no sensor is used in. Both are drawn again, up to a limit; then the world is refused.
SMALLEST_SCAN = 1000
LARGEST_SHARE_OF_RAIN = 0.4
MOST_TRIES = 100

Kinds = Annotated[Mapping[str, Kind], lambda kinds: any(kind.weight for kind in kinds.values())]


@dataclass(frozen=True)
class World(Settings):
    """The distributions that scans are drawn from.

    Attributes:
        places: Weight of each layout, by its name in ``LAYOUTS``; the default is all of them alike.
        horizon: Share of the places outdoors that go on to where only few beams reach.
        carrier: Share of the sensors that see what carries them.
        sensors: Ranges of sensors.
        precipitation: Kinds of precipitation by name, one of them with a weight; the default is all
            of KINDS.

    Raises:
        InputError: No weight above 0, or a share outside 0 to 1.
    """

    SUBJECT = "world"
    places: Mapping[str, float] = field(default_factory=lambda: dict.fromkeys(LAYOUTS, 1.0))
    horizon: Share = 0.7
    carrier: Share = 1.0
    sensors: SensorSpans = field(default_factory=SensorSpans)
    precipitation: Kinds = field(default_factory=KINDS.copy)
    READ_BY: ClassVar = {"places": weights_of(*LAYOUTS), "precipitation": kinds_of}


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


def draw_scan(world: World, generator: Generator) -> tuple[Scan, dict[str, Any]]:
    """Draws a place, a sensor and the weather, and takes a scan.

    Args:
        world: The ranges to draw from.
        generator: Random generator.

    Returns:
        The scan, intensities in 0..255, labels TrackClass; and the values drawn, as primitives:
        ``place``, the name of the layout, and the attributes of ``sensor`` and ``precipitation``.

    Raises:
        InputError: Nearly every scan of the world holds only rain, or Open3D cannot be imported.
    """
    for _ in range(MOST_TRIES):
        sensor = draw_sensor(world.sensors, generator)
        place = pick(world.places, generator)
        track = _lay_out(place, world, sensor, generator)
        precipitation = draw_precipitation(world.precipitation, generator)
        detected = meet(track.cast(sensor), sensor.beams(), precipitation, sensor, generator)
        scan = sensor.measure(detected, generator)
        rain = scan.label == TrackClass.RAIN
        if len(scan) >= SMALLEST_SCAN and np.mean(rain) <= LARGEST_SHARE_OF_RAIN:
            drawn = {"sensor": asdict(sensor), "precipitation": asdict(precipitation)}
            return scan, {"place": place, **drawn}
    raise InputError("world", "its scans are empty or nothing but rain", "Draw less rain.")


def _lay_out(place: str, world: World, sensor: Sensor, generator: Generator) -> Track:
    track = LAYOUTS[place](generator)
    if place not in INDOORS and generator.random() < world.horizon:
        track = track.with_surfaces(lay_out_horizon(generator))
    if generator.random() < world.carrier:
        track = track.with_surfaces(lay_out_carrier(generator, sensor.mounting_height))
    return track


@dataclass(frozen=True)
class WorldCampaign(SplitSequences):
    """A data set in which every sequence is one scan, of another place, sensor and weather.

    Attributes:
        train: Scans to train on, at least one.
        validation: Scans to choose a model with.
        test: Scans to judge it on.
        seed: Seed of everything drawn.
        world: The ranges to draw from, or the name of a packaged file of it, or of one's own.

    Raises:
        InputError: Too few or too many scans, or a negative seed.
    """

    train: AtLeastOne = 1000
    validation: Count = 100
    test: Count = 0
    seed: int = 0
    world: World | str = field(default_factory=World)
    SUBJECT = "worlds"
    DIGITS = 5

    def resolved(self) -> Self:
        """The same with its world read.

        Raises:
            InputError: A file that is missing or damaged.
        """
        world = load_world(self.world) if isinstance(self.world, str) else self.world
        return replace(self, world=world)

    def write(self, folder: Path, name: str) -> None:
        """Simulates a sequence: one scan, its labels, and what it was drawn as.

        Args:
            folder: Folder to write.
            name: Name of the sequence.

        Raises:
            InputError: A file cannot be written, or Open3D cannot be imported.
        """
        assert isinstance(self.world, World)  # after resolved()
        seed = np.random.SeedSequence(self.seed, spawn_key=(int(name),))
        scan, drawn = draw_scan(self.world, np.random.default_rng(seed))
        assert scan.label is not None  # a simulated scan is labelled
        write_scan(folder / FOLDERS.scans / f"{STEM}.bin", scan)
        write_labels(folder / FOLDERS.labels / f"{STEM}.label", *unpacked(scan.label))
        described = json.loads(json.dumps(drawn))
        write_text(folder / DRAWN_WORLDS, yaml.safe_dump(described, sort_keys=False))
