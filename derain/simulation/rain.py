"""Rain as a LiDAR meets it, drawn per beam: how many drops, where, how large, what returns."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from derain.errors import InputError
from derain.simulation.classes import TrackClass
from derain.simulation.sensor import Returns, Sensor

# Drop-size distribution N(D) = intercept · exp(−slope · D), in m⁻³ mm⁻¹.
# Source: Marshall and Palmer 1948, "The distribution of raindrops with size".
INTERCEPT = 8000.0

# Diameters drawn, millimetres. Smaller drops return too little to be seen one by one and count
# through the extinction alone; larger ones break up as they fall.
# Source: REHEARSE-3D, section III.E.
SMALLEST_DROP = 0.5
LARGEST_DROP = 6.0

# A drop much larger than the wavelength takes twice its cross-section out of the beam.
# Source: the geometric limit of Mie scattering.
EXTINCTION_EFFICIENCY = 2.0

# Fresnel reflectivity of water (refractive index 1.328 at 905 nm) at normal incidence. That a drop
# returns as much as a surface of this reflectivity is a modelling choice.
# Source: Kilic et al. 2021, "Lidar Light Scattering Augmentation (LISA)".
DROP_REFLECTIVITY = ((1.328 - 1) / (1.328 + 1)) ** 2


@dataclass(frozen=True)
class Rain:
    """Homogeneous rain with the drop sizes of Marshall and Palmer.

    Attributes:
        rate: Rain rate, mm/h; 0 is clear air.

    Raises:
        InputError: A rate that is negative or not finite.
    """

    rate: float

    def __post_init__(self) -> None:
        if not 0 <= self.rate < math.inf:
            raise InputError(
                "rain rate", f"{self.rate} mm/h is no rain rate", "Give 0 mm/h or more."
            )

    @property
    def slope(self) -> float:
        """How fast large drops get rare, Λ in mm⁻¹; infinite without rain.

        Source: Marshall and Palmer 1948, Λ = 4.1 R^−0.21.
        """
        return 4.1 * self.rate**-0.21 if self.rate else math.inf

    @property
    def extinction(self) -> float:
        """Share of the light that the rain takes out of a beam per metre, α in m⁻¹.

        π/4 · Q ∫ D² N(D) dD over all diameters, in closed form; 1e-6 turns mm² into m².

        Source: Kilic et al. 2021, "Lidar Light Scattering Augmentation (LISA)", for a constant
        extinction efficiency Q.
        """
        return 1e-6 * math.pi / 4 * EXTINCTION_EFFICIENCY * INTERCEPT * 2 / self.slope**3

    def transmission(self, range: NDArray[np.float64]) -> NDArray[np.float64]:
        """Share of the light that survives the way to distances in metres and back."""
        return np.exp(-2 * self.extinction * range)

    @property
    def drops_per_cubic_metre(self) -> float:
        """Number of drops from SMALLEST_DROP to LARGEST_DROP in a cubic metre."""
        above_smallest = math.exp(-self.slope * SMALLEST_DROP)
        above_largest = math.exp(-self.slope * LARGEST_DROP)
        return INTERCEPT / self.slope * (above_smallest - above_largest)

    def draw_diameters(self, count: int, generator: np.random.Generator) -> NDArray[np.float64]:
        """Draws drop diameters, float64 (count,), millimetres: an exponential, cut at both ends."""
        span = -math.expm1(-self.slope * (LARGEST_DROP - SMALLEST_DROP))
        return SMALLEST_DROP - np.log1p(-span * generator.random(count)) / self.slope


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


def draw_drops(
    rain: Rain, reach: NDArray[np.float64], sensor: Sensor, generator: np.random.Generator
) -> Drops:
    """Draws the drops inside every beam, from the minimum range to where the beam ends.

    Their number is Poisson with the volume of the beam's cone; they are uniform in that volume, so
    their distances follow the cone's cross-section.

    Args:
        rain: The rain.
        reach: Where each beam ends, float64 (N,), metres.
        sensor: The sensor whose beams they are.
        generator: Source of chance.
    """
    near = sensor.minimum_range
    far = np.maximum(reach, near)
    expected = rain.drops_per_cubic_metre * sensor.beam_volume(near, far)
    beam = np.repeat(np.arange(len(far)), generator.poisson(expected))
    share = generator.random(len(beam))
    distance = np.cbrt(near**3 + share * (far[beam] ** 3 - near**3))
    return Drops(beam, distance, rain.draw_diameters(len(beam), generator))


def drop_reflectivity(drops: Drops, sensor: Sensor) -> NDArray[np.float64]:
    """Apparent reflectivity of drops in clear air, float64 (M,): they cover a share of the beam.

    Source: Kilic et al. 2021, "Lidar Light Scattering Augmentation (LISA)".
    """
    beam_width = sensor.beam_spread * drops.range
    coverage = (1e-3 * drops.diameter / beam_width) ** 2
    return DROP_REFLECTIVITY * np.minimum(coverage, 1)


def farthest_visible_drop(sensor: Sensor) -> float:
    """Distance in metres beyond which not even the largest drop reaches the detection threshold.

    It solves DROP_REFLECTIVITY · (D / w r)² / r² = threshold for the range r, with a beam that is
    w r wide. Extinction only brings it nearer.
    """
    size = 1e-3 * LARGEST_DROP / sensor.beam_spread
    return math.sqrt(size * math.sqrt(DROP_REFLECTIVITY / sensor.detection_threshold))


def rain_on_beams(
    clear: Returns, rain: Rain, sensor: Sensor, generator: np.random.Generator
) -> Returns:
    """Sends the beams through rain and keeps the strongest return of each.

    A beam's return stays (weakened by the rain on its way there and back), gives way to a stronger
    drop in front of it, or is lost because nothing reaches the detection threshold. A beam that
    nothing returned ends at the maximum range, and can still meet a drop.

    Args:
        clear: What each beam would return through clear air, were the detector perfect.
        rain: The rain.
        sensor: The sensor whose beams they are.
        generator: Source of chance.

    Returns:
        What the sensor detects, one per beam.
    """
    # No drop beyond the horizon can be detected: leaving them out changes nothing but the cost.
    reach = np.minimum(clear.range, farthest_visible_drop(sensor))
    drops = draw_drops(rain, reach, sensor, generator)

    solid = clear.reflectivity * rain.transmission(clear.range)
    power = solid / clear.range**2
    seen = (power >= sensor.detection_threshold) & (clear.range >= sensor.minimum_range)
    detected = Returns(
        np.where(seen, clear.range, sensor.maximum_range),
        np.where(seen, solid, 0),
        np.where(seen, clear.label, TrackClass.BACKGROUND),
    )

    water = drop_reflectivity(drops, sensor) * rain.transmission(drops.range)
    power = water / drops.range**2
    stronger = power > np.maximum(detected.power[drops.beam], sensor.detection_threshold)
    # Where a beam holds several such drops the last assignment stays, hence the strongest last.
    drop = np.flatnonzero(stronger)[np.argsort(power[stronger])]
    beam = drops.beam[drop]
    detected.range[beam] = drops.range[drop]
    detected.reflectivity[beam] = water[drop]
    detected.label[beam] = TrackClass.RAIN
    return detected
