"""Number, sizes and extinction of the rain drops at a rain rate.

Rates are in mm/h, 0 being clear air, and may be arrays of any shape; results have that shape.
"""

import math

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike

from derain.simulation.arrays import Floats

# Drop-size distribution N(D) = INTERCEPT · exp(−slope · D), in m⁻³ mm⁻¹.
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


def slope(rate: ArrayLike) -> Floats:
    """How fast large drops get rare, Λ in mm⁻¹; infinite without rain.

    Source: Marshall and Palmer 1948, Λ = 4.1 R^−0.21.
    """
    with np.errstate(divide="ignore"):
        return np.asarray(4.1 * np.asarray(rate, np.float64) ** -0.21)


def extinction(rate: ArrayLike) -> Floats:
    """Share of the light that the rain takes out of a beam per metre, α in m⁻¹.

    π/4 · Q ∫ D² N(D) dD over all diameters, in closed form; 1e-6 turns mm² into m².

    Source: Kilic et al. 2021, "Lidar Light Scattering Augmentation (LISA)", for a constant
        extinction efficiency Q.
    """
    return 1e-6 * math.pi / 4 * EXTINCTION_EFFICIENCY * INTERCEPT * 2 / slope(rate) ** 3


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
