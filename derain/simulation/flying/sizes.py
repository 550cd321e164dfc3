"""How large particles are."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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

    diameter: NDArray[np.float64]
    share: NDArray[np.float64]

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
