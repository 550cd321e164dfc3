"""A front-view LiDAR: where its beams point, what it can detect, and how it measures."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from derain.scan import Scan

FULL_SCALE_INTENSITY = 255.0

# Standard deviation of what a detector adds to every intensity, a modelling choice: one count.
DARK_NOISE = 1.0


@dataclass(frozen=True, eq=False)
class Returns:
    """What comes back to the sensor, at most one return per beam, beams in the sensor's order.

    Attributes:
        range: Where the beam ends, as a distance from the sensor, float64 (N,), metres; the maximum
            range where nothing returned.
        reflectivity: Apparent reflectivity, float64 (N,), in 0..1: what a surface across the whole
            beam and facing the sensor would need to return as much through clear air. 0 where
            nothing returned.
        label: TrackClass of what was hit, int64 (N,); 0 where nothing returned.
    """

    range: NDArray[np.float64]
    reflectivity: NDArray[np.float64]
    label: NDArray[np.int64]

    @property
    def returned(self) -> NDArray[np.bool_]:
        """True for the beams with a return, bool (N,)."""
        return self.reflectivity > 0

    @property
    def power(self) -> NDArray[np.float64]:
        """Received power, float64 (N,), m⁻²: that of reflectivity 1 at 1 m is 1."""
        return self.reflectivity / self.range**2


@dataclass(frozen=True)
class Sensor:
    """A scanning LiDAR that keeps the strongest return of every beam.

    The defaults are modelling choices. The field of view resembles an automotive MEMS LiDAR's, on
    a coarse grid so that a scan is made in milliseconds; 256 rows by 1150 columns is full size.

    Attributes:
        azimuth: Right-most and left-most beam, degrees from x towards y.
        inclination: Lowest and highest beam, degrees above the horizon.
        columns: Beams per row.
        rows: Beams per column.
        minimum_range: What is nearer is not seen, metres.
        maximum_range: What is farther is not seen, metres.
        beam_divergence: Full opening angle of a beam, radians.
        detection_threshold: Weakest power that counts as a return, m⁻² (see Returns.power). The
            default sees a tenth of a perfect reflector at 160 m.
        range_noise: Standard deviation of a measured distance, metres.
        intensity_noise: Standard deviation of a measured intensity, relative to it.
        mounting_height: Height above the road, metres.
    """

    azimuth: tuple[float, float] = (-57.5, 57.5)
    inclination: tuple[float, float] = (-17.5, 7.5)
    columns: int = 400
    rows: int = 64
    minimum_range: float = 1.0
    maximum_range: float = 120.0
    beam_divergence: float = 1.5e-3
    detection_threshold: float = 4e-6
    range_noise: float = 0.02
    intensity_noise: float = 0.15
    mounting_height: float = 1.3

    def beams(self) -> NDArray[np.float64]:
        """Unit vectors along the beams, float64 (rows · columns, 3), sensor frame.

        Row-major, from the highest row and from the left.
        """
        inclination = np.radians(np.linspace(*self.inclination[::-1], self.rows))[:, None]
        azimuth = np.radians(np.linspace(*self.azimuth[::-1], self.columns))[None, :]
        x = np.cos(inclination) * np.cos(azimuth)
        y = np.cos(inclination) * np.sin(azimuth)
        z = np.broadcast_to(np.sin(inclination), x.shape)
        return np.stack([x, y, z], axis=-1).reshape(-1, 3)

    @property
    def beam_spread(self) -> float:
        """Width that a beam gains with distance, metres per metre: its width at 1 m."""
        return 2 * math.tan(self.beam_divergence / 2)

    def beam_volume(self, near: float, far: NDArray[np.float64]) -> NDArray[np.float64]:
        """Volume of a beam's cone between two distances in metres, in cubic metres."""
        return math.pi / 12 * self.beam_spread**2 * (far**3 - near**3)

    def measure(self, returns: Returns, generator: np.random.Generator) -> Scan:
        """Turns the returns into a scan, with the noise of the measurement.

        Args:
            returns: One per beam of this sensor.
            generator: Source of the noise.

        Returns:
            A scan of the beams that returned, with intensity in 0..255 and labels. Intensity is
            linear in apparent reflectivity, as of a sensor that corrects for distance.
        """
        seen = returns.returned
        count = np.count_nonzero(seen)
        distance = returns.range[seen] + generator.normal(0, self.range_noise, count)
        gain = generator.normal(1, self.intensity_noise, count)
        offset = generator.normal(0, DARK_NOISE, count)
        intensity = FULL_SCALE_INTENSITY * returns.reflectivity[seen] * gain + offset
        return Scan(
            (self.beams()[seen] * distance[:, None]).astype(np.float32),
            np.clip(intensity, 0, FULL_SCALE_INTENSITY).astype(np.float32),
            returns.label[seen],
        )
