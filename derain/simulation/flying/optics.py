"""Sizes of particles, their detection by a sensor, and the number that a beam meets."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from derain.scan import Floats
from derain.simulation.flying.precipitation import SMALLEST, Precipitation
from derain.simulation.sensor import Sensor

# Number of diameters that a distribution is drawn from, evenly spaced on a logarithmic scale: from
# .2 mm to 20 mm they are 1 % apart. Drawing from steps is a modelling choice.
CELLS = 480


@dataclass(frozen=True, eq=False)
class Sizes:
    """A distribution of diameters.

    Attributes:
        diameter: Those that there are, float64 (CELLS,), metres, ascending.
        share: Share of the particles that have each, float64 (CELLS,), with the sum 1.
    """

    diameter: Floats
    share: Floats

    @classmethod
    def gamma(cls, mean: float, shape: float, largest: float) -> "Sizes":
        """Gamma-distributed diameters, cut at SMALLEST and at the largest.

        Args:
            mean: Mean diameter before the cut, millimetres.
            shape: Shape of the distribution; 1 is exponential.
            largest: Millimetres.

        Source: Marshall and Palmer 1948 (rain) and Gunn and Marshall 1958 (snow), "The distribution
            with size of aggregate snowflakes", for the exponential; Ulbrich 1983 for the gamma.
        """
        edges = np.geomspace(SMALLEST, largest, CELLS + 1)
        middle = np.sqrt(edges[1:] * edges[:-1])
        # In logarithms, since a mean far outside the cut underflows.
        exponent = shape * np.log(middle) - shape * middle / mean
        share = np.exp(exponent - exponent.max())
        return cls(1e-3 * middle, share / share.sum())

    def moment(self, power: int) -> float:
        """Mean of a power of the diameter, in metres."""
        return float((self.share * self.diameter**power).sum())

    @property
    def extinction(self) -> float:
        """Extinction of a beam per metre by one particle per cubic metre, m⁻¹ · m³.

        Twice its cross-section, as of everything that is much larger than the wavelength.

        Source: the geometric limit of Mie scattering.
        """
        return 2 * math.pi / 4 * self.moment(2)


@dataclass(frozen=True)
class Optics:
    """A sensor's beams as particles meet them; detection is the sensor's own.

    A particle returns as much as a surface of its reflectivity that covers the same share of the
    beam: so the received power is gain · reflectivity · covered share / range².

    Attributes:
        aperture: Width of a beam where it leaves the sensor, metres.
        spread: Width that it gains with distance, metres per metre.
        brightness: Reflectivity of the brightest particles times the gain.
        threshold: Weakest power that counts as a return, m⁻².
        nearest: Distance within which no particle is reported, metres.
        farthest: Distance beyond which none is, metres.

    Source: Kilic et al. 2021, "Lidar Light Scattering Augmentation (LISA)", for the share.
    """

    aperture: float
    spread: float
    brightness: float
    threshold: float
    nearest: float
    farthest: float

    @classmethod
    def of(cls, precipitation: Precipitation, sensor: Sensor) -> "Optics":
        """The optics of a sensor in some precipitation.

        Where that states a reach, the gain is such that a particle of its mean diameter is at the
        detection threshold there. This is a modelling choice: for most sensors, neither the return
        of a particle over a surface nor the weighting of near returns is published.
        """
        aperture = precipitation.spill * sensor.aperture
        spread = precipitation.spill * sensor.beam_spread
        brightness, reach = precipitation.reflectivity, precipitation.reach
        if reach:
            covered = min(1e-3 * precipitation.diameter / (aperture + spread * reach), 1) ** 2
            brightness = sensor.detection_threshold * reach**2 / covered
        nearest = max(precipitation.nearest, sensor.minimum_range)
        farthest = min(precipitation.cut_off, sensor.maximum_range)
        threshold = sensor.detection_threshold
        return cls(aperture, spread, brightness, threshold, nearest, farthest)

    def width(self, range: Floats) -> Floats:
        """Width of a beam at distances in metres, in metres."""
        return self.aperture + self.spread * range

    def smallest_visible(self, range: Floats) -> Floats:
        """Diameter of the smallest particle that is seen at distances in metres, in metres.

        Infinite where not even one that fills the beam is.
        """
        needed = range * math.sqrt(self.threshold / self.brightness)
        seen = (needed <= 1) & (range <= self.farthest)
        return np.where(seen, self.width(range) * needed, math.inf)


# Slices that the beams are cut into, evenly spaced on a logarithmic scale.
SLICES = 40


class Slices:
    """Number of particles of each size that a beam meets in each slice of its length.

    A beam meets a particle whose centre is no farther from its axis than half of both widths. Only
    particles count that would be seen in the middle of the beam.

    Args:
        near: Begin of the first slice, metres.
        optics: The beams.
        sizes: Of the particles.

    Attributes:
        near: Begin of each slice, float64 (SLICES,), metres.
        far: End of each slice, float64 (SLICES,), metres.
        width: Width of the beam at that end, float64 (SLICES,), metres.
        met: Particles met in each slice for one per cubic metre, float64 (SLICES,), at most.
    """

    def __init__(self, near: float, optics: Optics, sizes: Sizes) -> None:
        edges = np.geomspace(near, max(optics.farthest, near), SLICES + 1)
        self.near, self.far = edges[:-1], edges[1:]
        # A slice is drawn as wide as at its far end, and with the sizes seen at its near end.
        self.width = optics.width(self.far)
        visible = sizes.diameter >= optics.smallest_visible(self.near)[:, None]
        area = np.pi / 4 * (self.width[:, None] + sizes.diameter) ** 2
        self._cumulative = np.cumsum(visible * sizes.share * area, axis=1)
        self._diameter = sizes.diameter
        self.met: Floats = self._cumulative[:, -1] * (self.far - self.near)

    def draw_diameters(self, slice_number: int, count: int, generator: Generator) -> Floats:
        """Diameters of particles that a beam meets in a slice, float64 (count,), metres."""
        cumulative = self._cumulative[slice_number]
        # The first cell that is above: those that are not visible add nothing, and are never it.
        cell = np.searchsorted(cumulative, cumulative[-1] * generator.random(count), side="right")
        return np.asarray(self._diameter[np.minimum(cell, len(self._diameter) - 1)])
