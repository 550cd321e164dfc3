"""The description of a simulated data set."""

import json
from abc import ABC, abstractmethod
from dataclasses import asdict, dataclass, field, replace
from itertools import cycle, islice
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

import numpy as np

from derain import __version__
from derain.cards.card import SPLIT_PARTS
from derain.errors import InputError
from derain.scan import Floats
from derain.simulation.layouts import LAYOUTS
from derain.simulation.manifest import MAKER, RAIN_RATE
from derain.simulation.radar import Radar
from derain.simulation.rain_field import UniformRain
from derain.simulation.sensor import Sensor, load_sensor
from derain.simulation.settings import Settings, Within

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
class Drive(Settings):
    """A drive along a street, or a sensor at rest in it while others move.

    Attributes:
        speed: Speed of the sensor along the street, m/s; 0 stands.
        traffic: Number of cars and pedestrians that move, each at a speed of its own.
        skew: True if every beam sees the scene at the time of that beam, so that moving objects
            and the sensor's motion skew a scan; False if all beams see the scene at the start of
            the scan, as after a perfect correction.

    Raises:
        InputError: A speed or a number that is impossible.
    """

    SUBJECT = "drive"
    speed: Annotated[float, Within(0, FASTEST)] = 0.0
    traffic: Annotated[int, Within(0, MOST_TRAFFIC)] = 0
    skew: bool = False


# Numbers of sequences and of scans: at least one, or also none.
AtLeastOne = Annotated[int, Within(1, MOST)]
Count = Annotated[int, Within(0, MOST)]


class SplitSequences(Settings, ABC):
    """A data set of sequences that are drawn by their numbers and split into three parts.

    Attributes:
        train: Number to train on, at least one.
        validation: Number to choose a model with.
        test: Number to judge it on.
        seed: Seed of everything drawn.
        DIGITS: Of the name of a sequence.
    """

    DIGITS: ClassVar[int]
    train: AtLeastOne
    validation: Count
    test: Count
    seed: int

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
    def description(self) -> dict[str, Any]:
        """Everything that the files depend on, as reading it back from JSON gives it.

        Raises:
            InputError: A file that is missing or damaged.
        """
        content = {
            "made_by": MAKER,
            "version": __version__,
            self.SUBJECT: asdict(self.resolved()),
            "split": self.split,
        }
        return dict(json.loads(json.dumps(content)))

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

    train: AtLeastOne = 16
    validation: Count = 4
    test: Count = 8
    scans: AtLeastOne = 3
    rain_rates: Annotated[tuple[float, ...], bool] = (0.0, 10.0, 25.0, 50.0)
    seed: int = 0
    sensor: Sensor | str = field(default_factory=Sensor)
    layout: str = "street"
    radar: Radar | None = None
    drive: Drive | None = None
    SUBJECT = "campaign"
    DIGITS = 3

    def __post_init__(self) -> None:
        super().__post_init__()
        for rate in self.rain_rates:
            UniformRain(rate)
        if self.layout not in LAYOUTS:
            known = ", ".join(LAYOUTS)
            raise InputError("layout", f"'{self.layout}' is unknown", f"Take one of {known}.")
        if self.drive is None:
            return
        length = self.drive.speed * self.times[-1]
        too_long = f"{length:,.0f} m of street are more than {LONGEST:,.0f}"
        for is_wrong, reason, remedy in (
            (self.layout != "street", f"a {self.layout} has none", "Take the layout street."),
            (self.radar is not None, "has no radar", "Leave the radar out."),
            (length > LONGEST, too_long, "Simulate more sequences of fewer scans."),
        ):
            if is_wrong:
                raise InputError("drive", reason, remedy)

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
        """As of every campaign, with the rain rate of each sequence."""
        return super().description | {RAIN_RATE: self.rain_rate}


def partition(sequences: int) -> tuple[int, int, int]:
    """Divides a number of sequences into those to train on, to validate and to test on.

    Of one or two sequences none is held out: so few are only made to look at them.
    """
    held_out = max(1, round(HELD_OUT * sequences)) if sequences >= 3 else 0
    return sequences - 2 * held_out, held_out, held_out
