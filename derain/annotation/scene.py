"""A static scene as a person describes it: boxes around things, and where the road is."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from derain.annotation.boxes import Box, Correction
from derain.annotation.plane import PlaneSearch

Polygon = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Scene:
    """A static scene in the sensor's frame.

    Attributes:
        road: Corners x, y of the road polygon in order, metres.
        boxes: Boxes around the things in the scene, by name.
        rain_area: Corners x, y of the polygon that drops are labelled over, in order, metres; None
            takes the road, as the paper does. Drops beside the road are background then.
        height: Height above the road's plane, metres. Points that are higher, lie over the area of
            the rain and are in no box are rain. The paper does not state it. The default is the
            distance within which a point counts as lying in the plane: with a smaller one parts of
            an uneven road become rain, with a greater one low drops become road.
        plane: How the road's plane is sought.
        corrections: What is different about boxes in a sequence, by sequence and box.
    """

    road: Polygon
    boxes: Mapping[str, Box] = field(default_factory=dict)
    rain_area: Polygon | None = None
    height: float = 0.1
    plane: PlaneSearch = field(default_factory=PlaneSearch)
    corrections: Mapping[str, Mapping[str, Correction]] = field(default_factory=dict)

    def in_sequence(self, sequence: str) -> "Scene":
        """The scene as it is in a sequence: its boxes corrected."""
        corrections = self.corrections.get(sequence, {})
        boxes = {
            name: box.corrected(corrections[name]) if name in corrections else box
            for name, box in self.boxes.items()
        }
        return replace(self, boxes=boxes, corrections={})


def inside(polygon: Polygon, points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which points lie in a polygon, seen from above.

    Args:
        polygon: Corners x, y in order, metres, sensor frame.
        points: x, y and z, float64 (N, 3), metres, sensor frame.

    Returns:
        bool (N,).
    """
    from matplotlib.path import Path

    within: NDArray[np.bool_] = Path(polygon).contains_points(points[:, :2])
    return within
