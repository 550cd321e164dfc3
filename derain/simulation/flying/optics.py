"""How a sensor detects particles."""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np

from derain.simulation.arrays import Floats
from derain.simulation.flying.precipitation import Precipitation
from derain.simulation.sensor import Sensor


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
        farthest: Distance beyond which no particle is reported, metres.

    Source: Kilic et al. 2021, "Lidar Light Scattering Augmentation (LISA)", for the share.
    """

    aperture: float
    spread: float
    brightness: float
    threshold: float
    farthest: float

    @classmethod
    def of(cls, precipitation: Precipitation, sensor: Sensor) -> Self:
        """How a sensor sees some precipitation.

        Where that states a reach, the gain is such that a particle of its mean diameter is at the
        detection threshold there. A modelling choice: how strongly a particle returns over a
        surface, and how a sensor weighs what is near, is not published for most of them.
        """
        aperture = precipitation.spill * sensor.aperture
        spread = precipitation.spill * sensor.beam_spread
        brightness, reach = precipitation.reflectivity, precipitation.reach
        if reach:
            covered = min(1e-3 * precipitation.diameter / (aperture + spread * reach), 1) ** 2
            brightness = sensor.detection_threshold * reach**2 / covered
        farthest = min(precipitation.cut_off, sensor.maximum_range)
        return cls(aperture, spread, brightness, sensor.detection_threshold, farthest)

    def width(self, range: Floats) -> Floats:
        """Width of a beam at distances in metres, in metres."""
        return self.aperture + self.spread * range

    def smallest_visible(self, range: Floats) -> Floats:
        """Diameter of the smallest particle that is seen at distances in metres, in metres.

        Infinite where not even one that fills the beam is.
        """
        needed = range * math.sqrt(self.threshold / self.brightness)
        return np.where(
            (needed <= 1) & (range <= self.farthest), self.width(range) * needed, math.inf
        )


def nearest_seen(precipitation: Precipitation, sensor: Sensor) -> float:
    """Distance within which the sensor reports no particle, metres."""
    return max(precipitation.nearest, sensor.minimum_range)
