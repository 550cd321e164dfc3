"""Rain drops inside beams: how many, where, how large, and what they return."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from derain.simulation.marshall_palmer import (
    LARGEST_DROP,
    draw_diameters,
    drops_per_cubic_metre,
    slope,
)
from derain.simulation.rain_field import RainField
from derain.simulation.sensor import Sensor

# Fresnel reflectivity of water (refractive index 1.328 at 905 nm) at normal incidence. That a drop
# returns as much as a surface of this reflectivity is a modelling choice.
# Source: Kilic et al. 2021, "Lidar Light Scattering Augmentation (LISA)".
DROP_REFLECTIVITY = ((1.328 - 1) / (1.328 + 1)) ** 2


@dataclass(frozen=True, eq=False)
class Drops:
    """Rain drops inside beams.

    Attributes:
        beam: Row of the beam each drop is in, int64 (M,).
        range: Distance from the sensor, float64 (M,), metres.
        diameter: Diameter, float64 (M,), millimetres.
    """

    beam: NDArray[np.int64]
    range: NDArray[np.float64]
    diameter: NDArray[np.float64]

    def take(self, rows: NDArray[np.bool_]) -> "Drops":
        """The drops of a mask, bool (M,)."""
        return Drops(self.beam[rows], self.range[rows], self.diameter[rows])


def draw_drops(
    rate: float, reach: NDArray[np.float64], sensor: Sensor, generator: np.random.Generator
) -> Drops:
    """Draws the drops inside every beam, between the minimum range and the beam's end.

    The rain is the same everywhere. The number of drops in a beam is Poisson distributed with a
    mean proportional to the volume of the beam's cone. The drops are uniform in that volume, so
    that the density of their distances is proportional to the cone's cross-section.

    Args:
        rate: Rain rate, mm/h.
        reach: Where each beam ends, float64 (N,), metres.
        sensor: The sensor whose beams they are.
        generator: Random generator.
    """
    far = np.maximum(reach, sensor.minimum_range)
    near = np.full_like(far, sensor.minimum_range)
    expected = drops_per_cubic_metre(rate) * sensor.beam_volume(near, far)
    beam = np.repeat(np.arange(len(far)), generator.poisson(expected))
    # The volume up to some distance grows with the cube of the beam's width there. So the cube of
    # the width is uniform between those at both ends for drops that are uniform in the volume.
    narrowest, widest = sensor.beam_width(near) ** 3, sensor.beam_width(far) ** 3
    share = generator.random(len(beam))
    width = np.cbrt(narrowest[beam] + share * (widest - narrowest)[beam])
    distance = (width - sensor.aperture) / sensor.beam_spread
    return Drops(beam, distance, draw_diameters(rate, len(beam), generator))


def thin_out(
    drops: Drops, beams: NDArray[np.float64], rain: RainField, generator: np.random.Generator
) -> Drops:
    """Thins drops of a field's heaviest rain out to the rain that falls where they are.

    A drop of diameter D stays with the probability exp(−(Λ − Λ of the heaviest rain) D), which is
    the local density of drops of its size over their density in the heaviest rain. The drops that
    stay are a Poisson process of the local density, and have the local distribution of sizes.

    Args:
        drops: Drops of even rain at ``rain.heaviest``.
        beams: Unit vectors along the beams, float64 (N, 3), sensor frame.
        rain: The field.
        generator: Random generator.

    Source: Lewis and Shedler 1979, "Simulation of nonhomogeneous Poisson processes by thinning".
    """
    x, y = drops.range * beams[drops.beam, 0], drops.range * beams[drops.beam, 1]
    steeper = slope(rain.rate(x, y)) - slope(rain.heaviest)
    return drops.take(generator.random(len(drops.beam)) < np.exp(-steeper * drops.diameter))


def drop_reflectivity(drops: Drops, sensor: Sensor) -> NDArray[np.float64]:
    """Apparent reflectivity of drops in clear air, float64 (M,): they cover a share of the beam.

    Source: Kilic et al. 2021, "Lidar Light Scattering Augmentation (LISA)".
    """
    coverage = (1e-3 * drops.diameter / sensor.beam_width(drops.range)) ** 2
    return DROP_REFLECTIVITY * np.minimum(coverage, 1)


def farthest_visible_drop(sensor: Sensor) -> float:
    """Distance in metres beyond which not even the largest drop reaches the detection threshold.

    It solves DROP_REFLECTIVITY · (D / w)² / r² = threshold for the range r, with a beam that is
    w = aperture + spread · r wide. Extinction only brings it nearer.
    """
    product = 1e-3 * LARGEST_DROP * math.sqrt(DROP_REFLECTIVITY / sensor.detection_threshold)
    aperture, spread = sensor.aperture, sensor.beam_spread
    return (math.sqrt(aperture**2 + 4 * spread * product) - aperture) / (2 * spread)
