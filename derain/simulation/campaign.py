"""The description of a simulated data set."""

import json
from abc import ABC, abstractmethod
from dataclasses import asdict, dataclass, field, replace
from itertools import cycle, islice
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np

from derain import __version__
from derain.errors import InputError
from derain.files.documents import shown
from derain.scan import Floats
from derain.simulation.layouts import LAYOUTS
from derain.simulation.manifest import MAKER, RAIN_RATE, SPLIT_PARTS
from derain.simulation.radar import Radar
from derain.simulation.rain_field import UniformRain
from derain.simulation.sensor import Sensor, load_sensor

# Two of five sequences are clean, as are 39 % of REHEARSE-3D's. How often each rain rate occurs in
# it is not published. The first sequence has rain, because it may be the only one to train on.
# Source: REHEARSE-3D, sections III.A and III.C.
FACILITY_RAIN_RATES = (10.0, 0.0, 25.0, 0.0, 50.0)

# The most sequences that each part may have, and scans that each sequence may have. So many would
# take months to simulate.
MOST = 100_000

# Share of the sequences that is held out to validate on, and again to test on. REHEARSE-3D holds
# out 28 and 29 of 143.
# Source: data_cfg.yaml of the SalsaNext model published with REHEARSE-3D.
HELD_OUT = 0.2

# Fastest vehicle, m/s: 216 km/h.
FASTEST = 60.0

# Most things that move. A street has room for 25 or more within sight of a sensor that stands.
MOST_TRAFFIC = 20

# Longest drive, metres: its street has one and a half million triangles and is laid out in 10 s.
LONGEST = 2000.0


@dataclass(frozen=True)
class Drive:
    """A drive along a street, or a sensor at rest in it while others move.

    Attributes:
        speed: Speed of the sensor along the street, m/s; 0 stands.
        traffic: Number of cars and pedestrians that move, each at a speed of its own.
        skew: True if every beam sees the scene at the time of that beam, so that moving objects
            and the sensor's motion skew a scan; False if all beams see the scene at the start of
            the scan, as after a perfect correction.

    Raises:
        InputError: A speed or a number that is impossible, or skew where nothing moves.
    """

    speed: float = 0.0
    traffic: int = 0
    skew: bool = False

    def __post_init__(self) -> None:
        if not 0 <= self.speed <= FASTEST:
            reason = f"{shown(self.speed)} m/s is impossible"
            raise InputError("speed", reason, f"Give 0 (stands) to {FASTEST:g}.")
        if not 0 <= self.traffic <= MOST_TRAFFIC:
            reason = f"{shown(self.traffic)} is impossible"
            raise InputError("traffic", reason, f"Give 0 to {MOST_TRAFFIC}.")
        if self.skew and not (self.speed or self.traffic):
            reason = "there is none where nothing moves"
            raise InputError("skew", reason, "Give a speed or traffic.")

    def length(self, duration: float) -> float:
        """Length of the drive in metres.

        Args:
            duration: Duration, seconds.

        Raises:
            InputError: Too long a drive.
        """
        length = self.speed * duration
        if length > LONGEST:
            reason = f"{length:,.0f} m of street are more than {LONGEST:,.0f}"
            raise InputError("drive", reason, "Simulate more sequences of fewer scans.")
        return length


class SplitSequences(ABC):
    """A data set of sequences that are drawn by their numbers and split into three parts.

    Attributes:
        train: Number to train on, at least one.
        validation: Number to choose a model with.
        test: Number to judge it on.
        seed: Seed of everything drawn.
        DIGITS: Of the name of a sequence.
    """

    train: int
    validation: int
    test: int
    seed: int
    DIGITS: ClassVar[int]

    def __post_init__(self) -> None:
        for part in SPLIT_PARTS:
            _check_count(part, getattr(self, part), int(part == "train"))
        if self.seed < 0:
            raise InputError("seed", f"{shown(self.seed)} is negative", "Give 0 or more.")

    @property
    def names(self) -> list[str]:
        """Names of the sequences, in ascending order."""
        count = self.train + self.validation + self.test
        return [f"{number:0{self.DIGITS}d}" for number in range(count)]

    @property
    def split(self) -> dict[str, list[str]]:
        """Names of the sequences of each part."""
        names = iter(self.names)
        return {part: list(islice(names, getattr(self, part))) for part in SPLIT_PARTS}

    @property
    @abstractmethod
    def description(self) -> dict[str, Any]:
        """Everything that the files depend on, as reading it back from JSON gives it."""

    @abstractmethod
    def resolved(self) -> Self:
        """The same with every file that it names read.

        Raises:
            InputError: A file that is missing or damaged.
        """

    @abstractmethod
    def write(self, folder: Path, name: str) -> None:
        """Simulates a sequence.

        Args:
            folder: Folder to write.
            name: Name of the sequence.

        Raises:
            InputError: A file cannot be written, or Open3D cannot be imported.
        """

    def _described(self, **content: Any) -> dict[str, Any]:
        """A description, as reading it back from JSON gives it."""
        content = {"made_by": MAKER, "version": __version__, **content}
        return dict(json.loads(json.dumps(content)))


def _check_count(name: str, count: int, least: int) -> None:
    if not least <= count <= MOST:
        amount = "few" if count < least else "many"
        raise InputError(name, f"{shown(count)} is too {amount}", f"Give {least} to {MOST:,}.")


@dataclass(frozen=True)
class Campaign(SplitSequences):
    """A data set in which every sequence is of another track; its scans differ in rain and noise.

    Attributes:
        train: Sequences to train on, at least one.
        validation: Sequences to choose a model with.
        test: Sequences to judge it on.
        scans: Scans per sequence.
        rain_rates: Rain rates in mm/h that the sequences take in turn; 0 is clean.
        seed: Seed of everything drawn.
        sensor: The LiDAR, or the name of a packaged sensor file, or of one of the user's.
        layout: One of :data:`LAYOUTS`: ``facility``, a test track under sprinklers, or a random
            place in even rain.
        radar: The radar; None leaves it out, and with it the folders of its scans.
        drive: Motion in a street, without a radar; None if nothing moves.

    Raises:
        InputError: Too few or too many sequences or scans, a negative seed, no rain rate or an
            impossible one, an unknown layout, or a drive that is too long, elsewhere than in a
            street or with a radar.
    """

    train: int = 16
    validation: int = 4
    test: int = 8
    scans: int = 3
    rain_rates: tuple[float, ...] = (0.0, 10.0, 25.0, 50.0)
    seed: int = 0
    sensor: Sensor | str = field(default_factory=Sensor)
    layout: str = "street"
    radar: Radar | None = None
    drive: Drive | None = None
    DIGITS = 3

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_count("scans", self.scans, 1)
        if not self.rain_rates:
            raise InputError("rain rate", "none is given", "Give one or more, in mm/h.")
        for rate in self.rain_rates:
            UniformRain(rate)
        if self.layout not in LAYOUTS:
            known = ", ".join(LAYOUTS)
            raise InputError("layout", f"'{self.layout}' is unknown", f"Take one of {known}.")
        if self.drive is None:
            return
        if self.layout != "street":
            raise InputError("drive", f"a {self.layout} has none", "Take the layout street.")
        if self.radar is not None:
            raise InputError("drive", "has no radar", "Leave the radar out.")
        self.drive.length(self.times[-1])

    @property
    def lidar(self) -> Sensor:
        """The LiDAR.

        Raises:
            InputError: A sensor file that is missing or damaged.
        """
        return load_sensor(self.sensor) if isinstance(self.sensor, str) else self.sensor

    def resolved(self) -> Self:
        """The same with its sensor read.

        Raises:
            InputError: A sensor file that is missing or damaged.
        """
        return replace(self, sensor=self.lidar)

    def write(self, folder: Path, name: str) -> None:
        """Simulates a sequence.

        Args:
            folder: Folder to write.
            name: Name of the sequence.

        Raises:
            InputError: A file cannot be written, or Open3D cannot be imported.
        """
        from derain.simulation.sequence import write_sequence  # which describes its scene by this

        write_sequence(folder, self, name)

    @property
    def times(self) -> Floats:
        """Time at which the scans of a sequence are taken, float64 (scans,), seconds from 0 on."""
        return np.arange(self.scans) / self.lidar.frame_rate

    @property
    def rain_rate(self) -> dict[str, float]:
        """Nominal rain rate of each sequence, in mm/h, by name in ascending order."""
        return dict(zip(self.names, cycle(map(float, self.rain_rates)), strict=False))

    @property
    def description(self) -> dict[str, Any]:
        """Everything that the files depend on, as reading it back from JSON gives it."""
        campaign = asdict(replace(self, sensor=self.lidar))
        return self._described(campaign=campaign, split=self.split) | {RAIN_RATE: self.rain_rate}


def partition(sequences: int) -> tuple[int, int, int]:
    """Divides a number of sequences into those to train on, to validate and to test on.

    Of one or two sequences none is held out: so few are only made to look at them.
    """
    held_out = max(1, round(HELD_OUT * sequences)) if sequences >= 3 else 0
    return sequences - 2 * held_out, held_out, held_out
