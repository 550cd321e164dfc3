"""A scanning LiDAR: where its beams point, and how it measures; packaged ones, as YAML files."""

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike

from derain.files.documents import Entry, packaged, packaged_or_own
from derain.files.extrinsics import motion_of_pose
from derain.scan import Floats, Ints, Scan
from derain.simulation.arrays import Returns as Returns
from derain.simulation.classes import TrackClass
from derain.simulation.defects import Defects
from derain.simulation.settings import Positive, Settings
from derain.views.spherical_grid import FULL_CIRCLE

FULL_SCALE_INTENSITY = 255.0

# Sensors of today have a tenth of it; the rays of this number of beams take 200 MB.
MOST_BEAMS = 2**22

# Prisms of today turn some hundred times a second.
MOST_TURNS = 1e6

# Standard deviation of what a detector adds to every intensity, a modelling choice: one count.
DARK_NOISE = 1.0

# What a sensor reports of a beam that several things return.
ReturnMode = Literal["strongest", "last", "dual"]

# How the shots of a scan follow each other.
Pattern = Literal["grid", "rosette"]


@dataclass(frozen=True)
class Sensor(Settings):
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
        row_azimuths: Angle of every row to the left of its columns, degrees; empty if the rows are
            one above the other.
        pattern: ``grid``, or ``rosette``: two prisms deflect the beams over the ellipse that fits
            into the field of view. Then a row is what one laser sees, in the order of time;
            ``row_inclinations`` is by how much it points above the others, and without them all
            lasers fire along one curve in turn.
        prism_turns: Turns of each prism of a rosette during a scan, negative the other way;
            every scan begins with the same position of both. Those of the Livox Mid-40, which turn
            7,294 and −4,664 times a minute, at ten scans a second.
        tilt: Roll and pitch of the sensor where it is mounted, degrees; positive pitch looks down.
        minimum_range: Nearer surfaces are not seen, metres.
        maximum_range: Farther surfaces are not seen, metres.
        aperture: Width of a beam where it leaves the sensor, metres.
        beam_divergence: Full opening angle of a beam, radians.
        detection_threshold: Weakest power that counts as a return, m⁻² (see Returns.power). The
            default sees a tenth of a perfect reflector at 160 m.
        range_noise: Standard deviation of a measured distance, metres.
        range_noise_growth: Another that grows with distance, metres per metre.
        weak_range_noise: Another for returns at the detection threshold, metres; it falls with the
            square root of power, as where a distance is measured from counted photons.
        encoder_noise: Standard deviation of the azimuth that is measured of a column, degrees.
        intensity_noise: Standard deviation of a measured intensity, relative to it.
        mounting_height: Height above the road, metres.
        returns: Reported returns of a beam with several: ``strongest``, ``last`` (the farthest of
            those detected), or ``dual`` (both, if they differ).
        frame_rate: Scans per second, Hz.
        defects: Defects of its scans.

    Raises:
        InputError: A value that no sensor can have.
    """

    SUBJECT = "sensor"
    azimuth: tuple[float, float] = (-57.5, 57.5)
    inclination: tuple[float, float] = (-17.5, 7.5)
    columns: int = 400
    rows: int = 64
    row_inclinations: tuple[float, ...] = ()
    row_azimuths: tuple[float, ...] = ()
    pattern: Pattern = "grid"
    prism_turns: tuple[float, float] = (12.16, -7.77)
    tilt: tuple[float, float] = (0.0, 0.0)
    minimum_range: Positive = 1.0
    maximum_range: float = 120.0
    aperture: float = 0.0
    beam_divergence: Positive = 1.5e-3
    detection_threshold: Positive = 4e-6
    range_noise: float = 0.02
    range_noise_growth: float = 0.0
    weak_range_noise: float = 0.0
    encoder_noise: float = 0.0
    intensity_noise: float = 0.15
    mounting_height: float = 1.3
    returns: ReturnMode = "strongest"
    frame_rate: Positive = 10.0
    defects: Defects = field(default_factory=Defects)

    def _possible(self) -> dict[str, bool]:
        (right, left), (lowest, highest) = self.azimuth, self.inclination
        return {
            "azimuth": right < left <= right + FULL_CIRCLE,
            "inclination": -90 <= lowest < highest <= 90,
            "columns": isinstance(self.columns, int) and 1 <= self.columns <= MOST_BEAMS,
            "rows": isinstance(self.rows, int) and 1 <= self.rows * self.columns <= MOST_BEAMS,
            "row_inclinations": len(self.row_inclinations) in (0, self.rows)
            and all(-90 <= inclination <= 90 for inclination in self.row_inclinations),
            "row_azimuths": len(self.row_azimuths) in (0, self.rows)
            and all(abs(azimuth) <= FULL_CIRCLE for azimuth in self.row_azimuths),
            "prism_turns": all(abs(turns) <= MOST_TURNS for turns in self.prism_turns),
            "tilt": all(abs(angle) <= 90 for angle in self.tilt),
            "maximum_range": self.minimum_range < self.maximum_range < math.inf,
            "beam_divergence": 0 < self.beam_divergence < math.pi,
            "encoder_noise": 0 <= self.encoder_noise < FULL_CIRCLE,
        }

    def beams(self) -> Floats:
        """Unit vectors along the beams, float64 (rows · columns, 3), frame of the level sensor.

        Row-major; in a grid from the highest row and from the left. The frame has the place and
        the heading of the sensor's own, in which it reports its scans, but is not tilted.
        """
        own = unit_vectors(*self._angles())
        return own @ self.mounting[:3, :3].T if any(self.tilt) else own

    @property
    def mounting(self) -> Floats:
        """Turns points of a scan into the frame of the level sensor, float64 (4, 4)."""
        return motion_of_pose(0, 0, 0, *self.tilt, 0)

    def _angles(self) -> tuple[Floats, Floats]:
        """Azimuth and inclination of the beams in the sensor's own frame, degrees.

        Both can be broadcast to (rows, columns).
        """
        azimuth, inclination = self._rosette() if self.pattern == "rosette" else self._grid()
        if self.row_azimuths:
            azimuth = azimuth + np.array(self.row_azimuths)[:, None]
        return azimuth, inclination

    def _grid(self) -> tuple[Floats, Floats]:
        right, left = self.azimuth
        closed = left - right == FULL_CIRCLE
        azimuth = np.linspace(left, right, self.columns, endpoint=not closed)[None, :]
        table = self.row_inclinations or np.linspace(*self.inclination[::-1], self.rows)
        return azimuth, np.array(table)[:, None]

    def _rosette(self) -> tuple[Floats, Floats]:
        """Directions of lasers that look through two wedge prisms, which turn at different speeds.

        Each prism deflects by half of what the two can do together, towards where it is turned to;
        the deflections add up, so that the shots fill an ellipse with a rosette.

        Source: Brazeal et al. 2021, "A rigorous observation model for the Risley prism-based Livox
        Mid-40 lidar sensor", here to the first order in the deflections.
        """
        offsets = np.array(self.row_inclinations)[:, None] if self.row_inclinations else 0.0
        # Lasers that look the same way fire along one curve in turn.
        delay = np.zeros(self.rows) if self.row_inclinations else np.arange(self.rows) / self.rows
        share = (np.arange(self.columns) + delay[:, None]) / self.columns
        first, second = (2 * np.pi * turns * share for turns in self.prism_turns)
        (right, left), (lowest, highest) = self.azimuth, self.inclination
        azimuth = (left + right) / 2 + (left - right) / 4 * (np.cos(first) + np.cos(second))
        swing = (highest - lowest) / 4 * (np.sin(first) + np.sin(second))
        return azimuth, (highest + lowest) / 2 + offsets + swing

    def beam_times(self) -> Floats:
        """Time of each beam, float64 (rows · columns,), seconds after the scan begins.

        Columns follow each other from the left to the right, as of a sensor that spins clockwise.
        """
        column = np.arange(self.rows * self.columns) % self.columns
        return column / (self.columns * self.frame_rate)

    @property
    def beam_spread(self) -> float:
        """Width that a beam gains with distance, metres per metre."""
        return 2 * math.tan(self.beam_divergence / 2)

    def beam_width(self, range: Floats) -> Floats:
        """Width of a beam at distances in metres, in metres."""
        return self.aperture + self.beam_spread * range

    def detected(self, clear: Returns, transmission: Floats) -> Returns:
        """The detected returns of surfaces without any particles in front of them.

        Args:
            clear: Return of each beam through clear air to a perfect detector.
            transmission: Share of the light that survives the way there and back, float64 (N,).
        """
        reflectivity = clear.reflectivity * transmission
        strong = reflectivity >= self.detection_threshold * clear.range**2
        seen = strong & (clear.range >= self.minimum_range)
        return Returns(
            np.where(seen, clear.range, self.maximum_range),
            np.where(seen, reflectivity, 0),
            np.where(seen, clear.label, TrackClass.BACKGROUND),
            clear.beam,
        )

    def reported(self, candidates: Returns) -> Returns:
        """The returns that the sensor reports, out of all that it could detect.

        Args:
            candidates: At least one row for every beam; of a beam that nothing returned one without
                reflectivity. In any order.

        Returns:
            One row for each beam, in their order; of a sensor with dual returns a second one where
            the last return is not the strongest.
        """
        power = candidates.power
        # A surface ends its beam: where it is seen, it is the last return.
        distance = np.where(candidates.returned, candidates.range, 0)
        scores = {"strongest": [power], "last": [distance], "dual": [power, distance]}
        rows = [_greatest(score, candidates.beam) for score in scores[self.returns]]
        chosen = np.stack(rows, axis=1)
        # The second of two only where it is another one.
        another = np.diff(chosen, axis=1, prepend=-1) != 0
        return candidates.take(chosen[another])

    def measure(self, returns: Returns, generator: Generator) -> Scan:
        """Turns the returns into a scan, with the noise of the measurement.

        Args:
            returns: Of beams of this sensor.
            generator: Source of the noise.

        Returns:
            A scan of what returned, with intensity in 0..255 and labels, in the sensor's own frame.
        """
        dual = self.returns == "dual"
        returns = self.defects.at_borders(returns, self.columns, dual=dual, generator=generator)
        received = self.defects.received(returns, (self.rows, self.columns), generator)
        seen = returns.take(received & returns.returned)
        distance = self.measured_range(seen.range, generator, seen.power)
        intensity = self.measured_intensity(seen.reflectivity, generator)
        direction = self._measured_directions(seen.beam, generator)
        xyz = direction * self.defects.stepped(distance)[:, None]
        scan = Scan(xyz.astype(np.float32), intensity.astype(np.float32), seen.label)
        return scan.take(self.defects.reported(seen.beam, generator))

    def _measured_directions(self, beam: Ints, generator: Generator) -> Floats:
        """Unit vectors in the sensor's own frame, float64 (N, 3), as the encoder measures them."""
        azimuth, inclination = self._angles()
        if self.encoder_noise:
            azimuth = azimuth + generator.normal(0, self.encoder_noise, self.columns)
        return unit_vectors(azimuth, inclination)[beam]

    def measured_range(
        self, range: Floats, generator: Generator, power: Floats | None = None
    ) -> Floats:
        """Distances in metres, float64 (N,), with the noise of the measurement.

        Args:
            range: True distances, float64 (N,), metres.
            generator: Source of the noise.
            power: Received power, float64 (N,), m⁻²; without it no return is weak.
        """
        deviation = np.hypot(self.range_noise, self.range_noise_growth * range)
        if power is not None and self.weak_range_noise:
            excess = np.maximum(power / self.detection_threshold, 1)
            deviation = np.hypot(deviation, self.weak_range_noise / np.sqrt(excess))
        return range + generator.normal(0, deviation)

    def measured_intensity(self, reflectivity: Floats, generator: Generator) -> Floats:
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


def unit_vectors(azimuth: ArrayLike, inclination: ArrayLike) -> Floats:
    """Unit vectors along directions.

    Args:
        azimuth: From x towards y, degrees.
        inclination: Above the horizon, degrees; the shapes of both are broadcast.

    Returns:
        float64 (N, 3) in row-major order; x forward, y left, z up.
    """
    azimuth, inclination = np.radians(azimuth), np.radians(inclination)
    x = np.cos(inclination) * np.cos(azimuth)
    y = np.cos(inclination) * np.sin(azimuth)
    z = np.broadcast_to(np.sin(inclination), x.shape)
    return np.stack([x, y, z], axis=-1).reshape(-1, 3)


def _greatest(value: Floats, beam: Ints) -> Ints:
    """Row of the greatest value of every beam, int64 (N,), where each of N beams has one."""
    ascending = np.argsort(value, kind="stable")
    row = np.empty(beam.max(initial=-1) + 1, np.int64)
    row[beam[ascending]] = ascending  # of several rows the last assigned stays
    return row


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
    return Sensor.of(Entry.of_yaml(packaged_or_own(name, packaged_sensors(), "sensor")))
