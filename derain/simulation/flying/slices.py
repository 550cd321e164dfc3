"""How many particles a beam meets, slice by slice of its length."""

import numpy as np
from numpy.typing import NDArray

from derain.simulation.flying.optics import Optics
from derain.simulation.flying.sizes import Sizes

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
    def met(self) -> NDArray[np.float64]:
        """Particles met in each slice for one per cubic metre, float64 (SLICES,), at most."""
        return np.asarray(self._cumulative[:, -1] * (self.far - self.near))

    def draw_diameters(
        self, slice_number: int, count: int, generator: np.random.Generator
    ) -> NDArray[np.float64]:
        """Diameters of particles that a beam meets in a slice, float64 (count,), metres."""
        cumulative = self._cumulative[slice_number]
        # The first cell that is above: those that are not visible add nothing, and are never it.
        cell = np.searchsorted(cumulative, cumulative[-1] * generator.random(count), side="right")
        return np.asarray(self._diameter[np.minimum(cell, len(self._diameter) - 1)])
