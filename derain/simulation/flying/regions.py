"""Where particles fly: in all the air, or low over the ground."""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from derain.simulation.flying.gusts import Gusts
from derain.simulation.flying.particles import Stretch

# Multiples of its height where the density of a layer has fallen to almost nothing.
LAYER_TOP = 4.0


class Region(Protocol):
    """A part of space with a density of particles."""

    def stretch(self, beams: NDArray[np.float64], stretch: Stretch) -> Stretch:
        """The part of each beam's stretch that the region has, at least.

        Args:
            beams: Unit vectors, float64 (N, 3), sensor frame.
            stretch: What the beams have in front of the surfaces.
        """

    def density(self, place: NDArray[np.float64]) -> NDArray[np.float64]:
        """Density over the greatest, float64 (N,), in 0..1, at places, float64 (N, 3), metres."""


@dataclass(frozen=True, eq=False)
class Air:
    """All the air, with its gusts."""

    gusts: Gusts

    def stretch(self, beams: NDArray[np.float64], stretch: Stretch) -> Stretch:
        """All of it."""
        return stretch

    def density(self, place: NDArray[np.float64]) -> NDArray[np.float64]:
        """That of the gusts."""
        return self.gusts(place)


@dataclass(frozen=True, eq=False)
class GroundLayer:
    """A layer over the ground, which is level, in which the density falls exponentially.

    Attributes:
        ground: Height of the ground in the sensor frame, metres, below 0.
        height: Over which the density falls to 1/e, metres.
        gusts: How it varies besides.
    """

    ground: float
    height: float
    gusts: Gusts

    def stretch(self, beams: NDArray[np.float64], stretch: Stretch) -> Stretch:
        """Where beams are under the top of the layer."""
        top = self.ground + LAYER_TOP * self.height
        rise = beams[:, 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = np.nan_to_num(top / rise, nan=math.inf)
        if top > 0:  # beams that rise leave the layer
            return Stretch(
                stretch.near,
                np.where(rise > 0, np.minimum(stretch.far, crossing), stretch.far),
            )
        enters = np.where(rise < 0, np.maximum(stretch.near, crossing), math.inf)
        return Stretch(enters, stretch.far)

    def density(self, place: NDArray[np.float64]) -> NDArray[np.float64]:
        """Densest at the ground; none below it."""
        above = place[:, 2] - self.ground
        fallen = np.exp(-np.maximum(above, 0) / self.height)
        return np.where(above >= 0, fallen, 0) * self.gusts(place)
