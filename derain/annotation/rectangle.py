"""Rectangles on the ground: what boxes stand on."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

# Headings are found to this accuracy, degrees; at 100 m it makes 2 mm.
FINEST_HEADING = 1e-3


@dataclass(frozen=True)
class Rectangle:
    """A rectangle seen from above.

    Attributes:
        centre: Its centre x, y, metres.
        size: Its length along the heading and its width across, metres.
        heading: Degrees from x towards y.
    """

    centre: tuple[float, float]
    size: tuple[float, float]
    heading: float

    @classmethod
    def around(cls, points: NDArray[np.float64]) -> "Rectangle":
        """The rectangle of the shortest outline around points, float64 (N ≥ 1, 2), metres."""
        heading, span = 45.0, 45.0
        while span > FINEST_HEADING:
            headings = heading + np.linspace(-span, span, 91)
            outline = [np.ptp(points @ _axes(each), axis=0).sum() for each in headings]
            heading, span = float(headings[np.argmin(outline)]), span / 45
        turned = points @ _axes(heading)
        lowest, highest = turned.min(axis=0), turned.max(axis=0)
        x, y = _axes(heading) @ (lowest + highest) / 2
        length, width = highest - lowest
        return cls((float(x), float(y)), (float(length), float(width)), heading)

    def widened(self, margin: float) -> "Rectangle":
        """The same rectangle with a margin on every side, metres."""
        length, width = self.size
        return Rectangle(self.centre, (length + 2 * margin, width + 2 * margin), self.heading)

    def relative(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Where points lie in the rectangle's frame: ahead and left of its centre.

        Args:
            points: float64 (..., 2), metres.

        Returns:
            float64 (..., 2), metres.
        """
        x, y = points[..., 0] - self.centre[0], points[..., 1] - self.centre[1]
        (cosine, _), (sine, _) = self._axes
        return np.stack([cosine * x + sine * y, cosine * y - sine * x], axis=-1)

    def contains(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Which points, float64 (N, 2), metres, lie inside or on the outline; bool (N,)."""
        ahead, left = self.relative(points).T
        length, width = self.size
        inside: NDArray[np.bool_] = (np.abs(ahead) <= length / 2) & (np.abs(left) <= width / 2)
        return inside

    def corners(self) -> NDArray[np.float64]:
        """Its corners x, y in order, float64 (4, 2), metres."""
        halves = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) / 2
        corners: NDArray[np.float64] = (halves * self.size) @ self._axes.T + self.centre
        return corners

    @cached_property
    def _axes(self) -> NDArray[np.float64]:
        return _axes(self.heading)


def _axes(heading: float) -> NDArray[np.float64]:
    """Columns are the directions ahead and left of a heading in degrees, (2, 2)."""
    cosine, sine = np.cos(np.radians(heading)), np.sin(np.radians(heading))
    return np.array([[cosine, -sine], [sine, cosine]])
