"""Rain in the beams of a LiDAR: drops, the light that passes, and what the sensor reports."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from derain.scan import Floats, Ints
from derain.simulation.arrays import Columns
from derain.simulation.classes import TrackClass
from derain.simulation.rain_field import INTERCEPT, RainField, extinction, slope
from derain.simulation.sensor import Returns, Sensor

# Fresnel reflectivity of water (refractive index 1.328 at 905 nm) at normal incidence. That a drop
# returns as much as a surface of this reflectivity is a modelling choice.
# Source: Kilic et al. 2021, "Lidar Light Scattering Augmentation (LISA)".
DROP_REFLECTIVITY = ((1.328 - 1) / (1.328 + 1)) ** 2

# Diameters drawn, millimetres. Smaller drops return too little to be seen one by one and count
# through the extinction alone; larger ones break up as they fall.
# Source: REHEARSE-3D, section III.E.
SMALLEST_DROP = 0.5
LARGEST_DROP = 6.0


@dataclass(frozen=True, eq=False)
class Drops(Columns):
    """Rain drops inside beams.

    Attributes:
        beam: Row of the beam each drop is in, int64 (M,).
        range: Distance from the sensor, float64 (M,), metres.
        diameter: Diameter, float64 (M,), millimetres.
    """

    beam: Ints
    range: Floats
    diameter: Floats


def drops_per_cubic_metre(rate: float) -> float:
    """Number of drops from SMALLEST_DROP to LARGEST_DROP in a cubic metre."""
    steepness = float(slope(rate))
    above_smallest = math.exp(-steepness * SMALLEST_DROP)
    above_largest = math.exp(-steepness * LARGEST_DROP)
    return INTERCEPT / steepness * (above_smallest - above_largest)


def draw_diameters(rate: float, count: int, generator: Generator) -> Floats:
    """Draws drop diameters, float64 (count,), millimetres: an exponential, cut at both ends."""
    steepness = float(slope(rate))
    span = -math.expm1(-steepness * (LARGEST_DROP - SMALLEST_DROP))
    return SMALLEST_DROP - np.log1p(-span * generator.random(count)) / steepness


def draw_drops(rate: float, reach: Floats, sensor: Sensor, generator: Generator) -> Drops:
    """Draws the drops inside every beam, between the minimum range and the beam's end.

    The rain is the same everywhere. The number of drops in a beam is Poisson distributed with a
    mean proportional to the volume of the beam's cone. The drops are uniform in that volume, so
    that the density of their distances is proportional to the cone's cross-section.

    Args:
        rate: Rain rate, mm/h.
        reach: Range at which each beam ends, float64 (N,), metres.
        sensor: The sensor whose beams they are.
        generator: Random generator.
    """
    far = np.maximum(reach, sensor.minimum_range)
    near = np.full_like(far, sensor.minimum_range)
    # The volume up to some distance grows with the cube of the beam's width there. So the cube of
    # the width is uniform between those at both ends for drops that are uniform in the volume.
    narrowest, widest = sensor.beam_width(near) ** 3, sensor.beam_width(far) ** 3
    volume = math.pi / 12 / sensor.beam_spread * (widest - narrowest)
    beam = np.repeat(np.arange(len(far)), generator.poisson(drops_per_cubic_metre(rate) * volume))
    share = generator.random(len(beam))
    width = np.cbrt(narrowest[beam] + share * (widest - narrowest)[beam])
    distance = (width - sensor.aperture) / sensor.beam_spread
    return Drops(beam, distance, draw_diameters(rate, len(beam), generator))


def thin_out(drops: Drops, beams: Floats, rain: RainField, generator: Generator) -> Drops:
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


def drop_reflectivity(drops: Drops, sensor: Sensor) -> Floats:
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


# Sampling of the field: the number of sectors around the sensor, and the step along each, metres.
SECTORS = 360
SAMPLE_SPACING = 1.0


class Transmission:
    """The share of the light that survives the way to a distance and back, seen from the sensor.

    The extinction is integrated over the ground by the trapezoidal rule, once for each sector of a
    degree. Beyond the last sample the mean extinction is taken to stay what it is up to there.

    Args:
        rain: The rain.
        maximum_range: Largest range of the sampled field, metres.
    """

    def __init__(self, rain: RainField, maximum_range: float) -> None:
        distance = SAMPLE_SPACING * np.arange(math.ceil(maximum_range / SAMPLE_SPACING) + 1)
        azimuth = 2 * np.pi * np.arange(SECTORS) / SECTORS
        direction = np.stack([np.cos(azimuth), np.sin(azimuth)])[:, :, None]
        x, y = direction * distance
        local = extinction(rain.rate(x, y))
        depth = np.cumsum((local[:, :-1] + local[:, 1:]) * SAMPLE_SPACING / 2, axis=1)
        # Mean extinction from the sensor to each sample, float64 (SECTORS, samples), m⁻¹. Unlike
        # the integral over the ground it holds for beams of every inclination, and interpolating
        # between samples is exact where the rain is the same everywhere.
        self._mean = np.concatenate([local[:, :1], depth / distance[1:]], axis=1)

    def __call__(self, beams: Floats, range: Floats) -> Floats:
        """Share of the light that survives the way there and back, float64 (N,).

        Args:
            beams: Unit vectors, float64 (N, 3), sensor frame.
            range: Distances along them, float64 (N,), metres.
        """
        x, y, _ = beams.T
        turn = np.arctan2(y, x) / (2 * np.pi)
        sector = np.rint(turn * SECTORS).astype(np.int64) % SECTORS
        last = self._mean.shape[1] - 1
        steps = np.minimum(range * np.hypot(x, y) / SAMPLE_SPACING, last)
        before = np.minimum(steps.astype(np.int64), last - 1)
        share = steps - before
        mean = (1 - share) * self._mean[sector, before] + share * self._mean[sector, before + 1]
        return np.asarray(np.exp(-2 * mean * range))


def rain_on_beams(
    clear: Returns, beams: Floats, rain: RainField, sensor: Sensor, generator: Generator
) -> Returns:
    """Sends beams through rain and keeps what the sensor reports of each.

    A beam's return stays (weakened by the rain on its way there and back), gives way to a drop in
    front of it, or is lost because nothing reaches the detection threshold. A beam that nothing
    returned ends at the maximum range, and can still meet a drop.

    Args:
        clear: Return of each beam through clear air to a perfect detector: one row for
            each of the N beams, in their order.
        beams: Unit vectors along them, float64 (N, 3), sensor frame.
        rain: The rain.
        sensor: The sensor that they belong to.
        generator: Random generator.

    Returns:
        What the sensor detects, one row for each beam; of a sensor with dual returns a second one
        where the last return is not the strongest.
    """
    transmission = Transmission(rain, sensor.maximum_range)
    solid = sensor.detected(clear, transmission(beams, clear.range))
    # A drop that could not be seen even through clear air is left out first, which saves work.
    reach = np.minimum(clear.range, farthest_visible_drop(sensor))
    drops = draw_drops(rain.heaviest, reach, sensor, generator)
    needed = sensor.detection_threshold * drops.range**2
    drops = drops.take(drop_reflectivity(drops, sensor) >= needed)
    drops = thin_out(drops, beams, rain, generator)
    reflectivity = drop_reflectivity(drops, sensor) * transmission(beams[drops.beam], drops.range)
    label = np.full(len(drops.beam), TrackClass.RAIN, np.int64)
    wet = Returns(drops.range, reflectivity, label, drops.beam)
    visible = wet.take(reflectivity >= sensor.detection_threshold * wet.range**2)
    return sensor.reported(Returns.joined([solid, visible]))
