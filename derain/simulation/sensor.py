"""A scanning LiDAR: where its beams point, what it can detect, and how it measures."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args, get_type_hints

import numpy as np
from numpy.typing import NDArray

from derain.errors import InputError
from derain.files.documents import Entry, shown
from derain.files.packaged import packaged, packaged_or_own
from derain.scan import Scan
from derain.views.spherical_grid import FULL_CIRCLE

FULL_SCALE_INTENSITY = 255.0

# Sensors of today have a tenth of it; the rays of so many take 200 MB.
MOST_BEAMS = 2**22

# Standard deviation of what a detector adds to every intensity, a modelling choice: one count.
DARK_NOISE = 1.0

# What a sensor reports of a beam that several things return.
ReturnMode = Literal["strongest", "last", "dual"]


@dataclass(frozen=True, eq=False)
class Returns:
    """What comes back to the sensor, ordered by beam.

    Every beam has a row, also one that nothing returned; a sensor of dual returns may give it two,
    the strongest first.

    Attributes:
        range: Where the beam ends, as a distance from the sensor, float64 (N,), metres; the maximum
            range where nothing returned.
        reflectivity: Apparent reflectivity, float64 (N,), in 0..1: what a surface across the whole
            beam and facing the sensor would need to return as much through clear air. 0 where
            nothing returned.
        label: TrackClass of what was hit, int64 (N,); 0 where nothing returned.
        beam: Row of the beam in :meth:`Sensor.beams`, int64 (N,), ascending.
    """

    range: NDArray[np.float64]
    reflectivity: NDArray[np.float64]
    label: NDArray[np.int64]
    beam: NDArray[np.int64]

    @property
    def returned(self) -> NDArray[np.bool_]:
        """True where something returned, bool (N,)."""
        return self.reflectivity > 0

    @property
    def power(self) -> NDArray[np.float64]:
        """Received power, float64 (N,), m⁻²: that of reflectivity 1 at 1 m is 1."""
        return self.reflectivity / self.range**2


@dataclass(frozen=True)
class Sensor:
    """A scanning LiDAR.

    The defaults are modelling choices. The field of view resembles an automotive MEMS LiDAR's, on
    a coarse grid so that a scan is made in milliseconds; ``mems_256`` is full size.

    Attributes:
        azimuth: Right-most and left-most beam, degrees from x towards y. On a full circle the two
            directions are one, and its beam comes once.
        inclination: Lowest and highest beam, degrees above the horizon.
        columns: Beams per row.
        rows: Beams per column.
        row_inclinations: Inclination of every row from top to bottom, degrees, where they are not
            evenly spaced; else empty.
        minimum_range: What is nearer is not seen, metres.
        maximum_range: What is farther is not seen, metres.
        aperture: Width of a beam where it leaves the sensor, metres.
        beam_divergence: Full opening angle of a beam, radians.
        detection_threshold: Weakest power that counts as a return, m⁻² (see Returns.power). The
            default sees a tenth of a perfect reflector at 160 m.
        range_noise: Standard deviation of a measured distance, metres.
        intensity_noise: Standard deviation of a measured intensity, relative to it.
        mounting_height: Height above the road, metres.
        returns: What is reported of a beam that several things return: ``strongest``, ``last``
            (the farthest of those detected), or ``dual`` (both, where they differ).
        frame_rate: Scans per second, Hz.

    Raises:
        InputError: A value that no sensor can have.
    """

    azimuth: tuple[float, float] = (-57.5, 57.5)
    inclination: tuple[float, float] = (-17.5, 7.5)
    columns: int = 400
    rows: int = 64
    row_inclinations: tuple[float, ...] = ()
    minimum_range: float = 1.0
    maximum_range: float = 120.0
    aperture: float = 0.0
    beam_divergence: float = 1.5e-3
    detection_threshold: float = 4e-6
    range_noise: float = 0.02
    intensity_noise: float = 0.15
    mounting_height: float = 1.3
    returns: ReturnMode = "strongest"
    frame_rate: float = 10.0

    def __post_init__(self) -> None:
        (right, left), (lowest, highest) = self.azimuth, self.inclination
        possible = {
            "azimuth": right < left <= right + FULL_CIRCLE,
            "inclination": -90 <= lowest < highest <= 90,
            "columns": isinstance(self.columns, int) and 1 <= self.columns <= MOST_BEAMS,
            "rows": isinstance(self.rows, int) and 1 <= self.rows * self.columns <= MOST_BEAMS,
            "row_inclinations": len(self.row_inclinations) in (0, self.rows)
            and all(-90 <= inclination <= 90 for inclination in self.row_inclinations),
            "minimum_range": self.minimum_range > 0,
            "maximum_range": self.minimum_range < self.maximum_range < math.inf,
            "aperture": 0 <= self.aperture < math.inf,
            "beam_divergence": 0 < self.beam_divergence < math.pi,
            "detection_threshold": 0 < self.detection_threshold < math.inf,
            "range_noise": 0 <= self.range_noise < math.inf,
            "intensity_noise": 0 <= self.intensity_noise < math.inf,
            "mounting_height": 0 <= self.mounting_height < math.inf,
            "returns": self.returns in get_args(ReturnMode),
            "frame_rate": 0 < self.frame_rate < math.inf,
        }
        for name, is_possible in possible.items():
            if not is_possible:
                raise InputError(
                    f"sensor: {name}", f"{shown(getattr(self, name))} is impossible", "Correct it."
                )

    def beams(self) -> NDArray[np.float64]:
        """Unit vectors along the beams, float64 (rows · columns, 3), sensor frame.

        Row-major, from the highest row and from the left.
        """
        right, left = self.azimuth
        closed = left - right == FULL_CIRCLE
        columns = np.linspace(left, right, self.columns, endpoint=not closed)
        rows = self.row_inclinations or np.linspace(*self.inclination[::-1], self.rows)
        azimuth, inclination = np.radians(columns)[None, :], np.radians(rows)[:, None]
        x = np.cos(inclination) * np.cos(azimuth)
        y = np.cos(inclination) * np.sin(azimuth)
        z = np.broadcast_to(np.sin(inclination), x.shape)
        return np.stack([x, y, z], axis=-1).reshape(-1, 3)

    def beam_times(self) -> NDArray[np.float64]:
        """When each beam is sent, float64 (rows · columns,), seconds after the scan begins.

        Columns follow each other from the left to the right, as of a sensor that spins clockwise.
        """
        column = np.arange(self.rows * self.columns) % self.columns
        return column / (self.columns * self.frame_rate)

    @property
    def beam_spread(self) -> float:
        """Width that a beam gains with distance, metres per metre."""
        return 2 * math.tan(self.beam_divergence / 2)

    def beam_width(self, range: NDArray[np.float64]) -> NDArray[np.float64]:
        """Width of a beam at distances in metres, in metres."""
        return self.aperture + self.beam_spread * range

    def beam_volume(
        self, near: NDArray[np.float64], far: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Volume of a beam's cone between two distances in metres, in cubic metres."""
        widths = self.beam_width(far) ** 3 - self.beam_width(near) ** 3
        return math.pi / 12 / self.beam_spread * widths

    def measure(self, returns: Returns, generator: np.random.Generator) -> Scan:
        """Turns the returns into a scan, with the noise of the measurement.

        Args:
            returns: Of beams of this sensor.
            generator: Source of the noise.

        Returns:
            A scan of what returned, with intensity in 0..255 and labels.
        """
        seen = returns.returned
        distance = self.measured_range(returns.range[seen], generator)
        return Scan(
            (self.beams()[returns.beam[seen]] * distance[:, None]).astype(np.float32),
            self.measured_intensity(returns.reflectivity[seen], generator).astype(np.float32),
            returns.label[seen],
        )

    def measured_range(
        self, range: NDArray[np.float64], generator: np.random.Generator
    ) -> NDArray[np.float64]:
        """Distances in metres, float64 (N,), with the noise of the measurement."""
        return range + generator.normal(0, self.range_noise, len(range))

    def measured_intensity(
        self, reflectivity: NDArray[np.float64], generator: np.random.Generator
    ) -> NDArray[np.float64]:
        """Intensities in 0..255, float64 (N,), with the noise of the measurement.

        They are linear in apparent reflectivity, as of a sensor that corrects for distance.

        Args:
            reflectivity: Apparent reflectivity, float64 (N,), in 0..1.
            generator: Source of the noise.
        """
        gain = generator.normal(1, self.intensity_noise, len(reflectivity))
        offset = generator.normal(0, DARK_NOISE, len(reflectivity))
        intensity = FULL_SCALE_INTENSITY * reflectivity * gain + offset
        return np.clip(intensity, 0, FULL_SCALE_INTENSITY)


def packaged_sensors() -> dict[str, Path]:
    """Files of the sensors that come with derain, by name."""
    return packaged("derain.simulation", "sensors")


def load_sensor(name: str | Path) -> Sensor:
    """Reads a sensor.

    Args:
        name: Name of a packaged sensor, or a YAML file with attributes of :class:`Sensor`; those
            that it leaves out have their defaults.

    Raises:
        InputError: No such sensor, or a file that does not describe one.
    """
    path = packaged_or_own(name, packaged_sensors(), "sensor")
    values = Entry.of_yaml(path).record(_PARSERS)
    try:
        return Sensor(**values)
    except InputError as error:
        raise InputError(
            path, f"{error.subject}: {error.reason}", "Take a packaged one as a pattern."
        ) from error


def _span(entry: Entry) -> tuple[float, ...]:
    return entry.numbers(2)


def _beams(entry: Entry) -> int:
    return entry.whole(1, MOST_BEAMS)


# What reads the attributes of a sensor, by their type.
_PARSERS_BY_TYPE: dict[Any, Callable[[Entry], Any]] = {
    tuple[float, float]: _span,
    tuple[float, ...]: Entry.numbers,
    int: _beams,
    float: Entry.number,
    ReturnMode: Entry.text,
}
_PARSERS = {name: _PARSERS_BY_TYPE[kind] for name, kind in get_type_hints(Sensor).items()}
