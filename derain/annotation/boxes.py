"""Upright boxes around the things that stand in a scene."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from derain.annotation.rectangle import Rectangle
from derain.simulation.classes import TrackClass

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Correction:
    """What is different about a box in one sequence.

    Attributes:
        shift: How far its centre moves along x, y and z, metres.
        size: Its length, width and height there, metres; None leaves them.
        heading: Its heading there, degrees; None leaves it.
    """

    shift: Triple = (0.0, 0.0, 0.0)
    size: Triple | None = None
    heading: float | None = None


@dataclass(frozen=True)
class Box:
    """An upright box; all that is in it is of one class.

    Attributes:
        kind: The class.
        centre: Its centre x, y, z, metres, sensor frame.
        size: Its length, width and height, metres; the length runs along the heading.
        heading: Its turn about the z axis, degrees from x towards y.
    """

    kind: TrackClass
    centre: Triple
    size: Triple
    heading: float = 0.0

    @property
    def footprint(self) -> Rectangle:
        """The ground that it stands on."""
        return Rectangle(self.centre[:2], self.size[:2], self.heading)

    def contains(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Which points lie in the box, its faces included.

        Args:
            points: x, y and z, float64 (N, 3), metres, sensor frame.

        Returns:
            bool (N,).
        """
        inside = self.footprint.contains(points[:, :2])
        inside &= np.abs(points[:, 2] - self.centre[2]) <= self.size[2] / 2
        return inside

    def corrected(self, correction: Correction) -> "Box":
        """The box as it is where a correction holds."""
        x, y, z = (here + shift for here, shift in zip(self.centre, correction.shift, strict=True))
        return replace(
            self,
            centre=(x, y, z),
            size=self.size if correction.size is None else correction.size,
            heading=self.heading if correction.heading is None else correction.heading,
        )
