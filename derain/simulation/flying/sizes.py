"""How large particles are, and how many of each size a beam meets."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from derain.simulation.arrays import Floats
from derain.simulation.flying.optics import Optics
from derain.simulation.flying.precipitation import SMALLEST

# Diameters that a distribution is drawn from, evenly spaced on a logarithmic scale: from .2 mm to
# 20 mm they are 1 % apart. That there are none between them is a modelling choice.
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
        """What one particle per cubic metre takes out of a beam per metre, m⁻¹ · m³.

        Twice its cross-section, as of everything that is much larger than the wavelength.

        Source: the geometric limit of Mie scattering.
        """
        return 2 * math.pi / 4 * self.moment(2)


# Slices that the beams are cut into, evenly spaced on a logarithmic scale.
SLICES = 40


class Slices:
    """How many particles of each size a beam meets in each slice of its length.

    A beam meets a particle whose centre is no farther from its axis than half of both widths. Only
    particles count that would be seen in the middle of the beam.

    Args:
        near: Where the first slice begins, metres.
        optics: The beams.
        sizes: Of the particles.
    """

    def __init__(self, near: float, optics: Optics, sizes: Sizes) -> None:
        edges = np.geomspace(near, max(optics.farthest, near), SLICES + 1)
        self.near, self.far = edges[:-1], edges[1:]
        # A slice is drawn as wide as at its far end, and with the sizes seen at its near end.
        self.width = optics.width(self.far)
        self.visible = sizes.diameter >= optics.smallest_visible(self.near)[:, None]
        area = np.pi / 4 * (self.width[:, None] + sizes.diameter) ** 2
        self._cumulative = np.cumsum(self.visible * sizes.share * area, axis=1)
        self._diameter = sizes.diameter

    @property
    def met(self) -> Floats:
        """Particles met in each slice for one per cubic metre, float64 (SLICES,), at most."""
        return np.asarray(self._cumulative[:, -1] * (self.far - self.near))

    def draw_diameters(self, slice_number: int, count: int, generator: Generator) -> Floats:
        """Diameters of particles that a beam meets in a slice, float64 (count,), metres."""
        cumulative = self._cumulative[slice_number]
        # The first cell that is above: those that are not visible add nothing, and are never it.
        cell = np.searchsorted(cumulative, cumulative[-1] * generator.random(count), side="right")
        return np.asarray(self._diameter[np.minimum(cell, len(self._diameter) - 1)])
