"""A static scene as a person describes it in a YAML file: the road, and boxes around objects.

    height: 0.1                                  # metres; points higher above the road are rain
    road: [[2, -4], [60, -4], [60, 4], [2, 4]]   # corners x, y in order, metres, sensor frame
    boxes:
      car_1: {class: car, centre: [20, 1, -0.6], size: [4.5, 1.8, 1.5], heading: 5}
      mast_1: {class: sprinkler, centre: [8, 4.5, 0.7], size: [0.3, 0.3, 4]}
    corrections:                                 # of boxes in some sequences
      "003": {boxes: {car_1: {shift: [0.2, 0, 0]}}}

Only the road is required. Where it rains beside the road, `rain_area` lists the corners of the area
in which drops are labelled. A correction may have shift, size and heading.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.path import Path as Outline

from derain.errors import InputError
from derain.files.documents import Entry
from derain.scan import Bools, Floats
from derain.simulation.classes import TrackClass

Triple = tuple[float, float, float]
Polygon = tuple[tuple[float, float], ...]

# Largest coordinate and length, metres: beyond the range of any LiDAR, and a product of three does
# not overflow.
FARTHEST = 1e6

CLASS_BY_NAME = {kind.name.lower(): kind for kind in TrackClass}


@dataclass(frozen=True)
class Box:
    """An upright box, whose points are all of one class.

    Attributes:
        kind: The class.
        centre: Its centre x, y, z, metres, sensor frame.
        size: Its length, width and height, metres; the length runs along the heading.
        heading: Its rotation about the z axis, degrees from x towards y.
    """

    kind: TrackClass
    centre: Triple
    size: Triple
    heading: float = 0.0

    def corners(self) -> Floats:
        """Its corners x, y as seen from above, in order, float64 (4, 2), metres."""
        halves = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) / 2
        cosine, sine = np.cos(np.radians(self.heading)), np.sin(np.radians(self.heading))
        ahead_and_left = np.array([[cosine, sine], [-sine, cosine]])
        return np.asarray((halves * self.size[:2]) @ ahead_and_left + self.centre[:2])

    def contains(self, points: Floats) -> Bools:
        """True for points that lie in the box; one exactly on a side may count as in it or not.

        Args:
            points: x, y and z, float64 (N, 3), metres, sensor frame.

        Returns:
            bool (N,).
        """
        level = np.abs(points[:, 2] - self.centre[2]) <= self.size[2] / 2
        return np.asarray(level & inside(self.corners(), points))

    def corrected(self, shift: Triple = (0.0, 0.0, 0.0), **others: Any) -> "Box":
        """The box with a correction applied.

        Args:
            shift: Shift of its centre along x, y and z, metres.
            others: Its ``size`` or its ``heading`` there, where they change.
        """
        x, y, z = (here + by for here, by in zip(self.centre, shift, strict=True))
        return replace(self, centre=(x, y, z), **others)


@dataclass(frozen=True)
class Scene:
    """A static scene in the sensor's frame.

    Attributes:
        road: Corners x, y of the road polygon in order, metres.
        boxes: Boxes around the objects in the scene, by name.
        rain_area: Corners x, y of the polygon in which drops are labelled, in order, metres; None
            takes the road, as the paper does, and drops beside the road are then background.
        height: Height above the road's plane, metres. Points above it, over the rain area and in
            no box are rain. The paper does not state it. The default is the distance within which
            a point counts as lying in the plane: with a smaller one parts of an uneven road become
            rain, with a greater one low drops become road.
        corrections: Corrections of boxes, by sequence and box, as :meth:`Box.corrected` takes them.
    """

    road: Polygon
    boxes: Mapping[str, Box] = field(default_factory=dict)
    rain_area: Polygon | None = None
    height: float = 0.1
    corrections: Mapping[str, Mapping[str, Mapping[str, Any]]] = field(default_factory=dict)

    def in_sequence(self, sequence: str) -> "Scene":
        """The scene with the boxes as corrected for a sequence."""
        corrections = self.corrections.get(sequence, {})
        boxes = {
            name: box.corrected(**corrections[name]) if name in corrections else box
            for name, box in self.boxes.items()
        }
        return replace(self, boxes=boxes, corrections={})


def inside(polygon: Polygon | Floats, points: Floats) -> Bools:
    """True for points that lie in a polygon, seen from above.

    Args:
        polygon: Corners x, y in order, metres, sensor frame.
        points: x, y and z, float64 (N, 3), metres, sensor frame.

    Returns:
        bool (N,).
    """
    return Outline(polygon).contains_points(points[:, :2])


def read_scene(path: Path) -> Scene:
    """Reads a scene file.

    Raises:
        InputError: A file that cannot be read, or an invalid value in it; the message names its
            key.
    """
    parsers = {
        "road": _polygon,
        "boxes": lambda entry: entry.each(_box),
        "rain_area": _polygon,
        "height": _metres,
        "corrections": lambda entry: entry.each(_corrections),
    }
    scene = Scene(**Entry.of_yaml(path).record(parsers, required=["road"]))
    for sequence, corrections in scene.corrections.items():
        for name in corrections:
            if name not in scene.boxes:
                place = f"{path}: corrections.{sequence}.boxes.{name}"
                remedy = f"Available: {', '.join(scene.boxes) or 'none'}."
                raise InputError(place, "there is no such box", remedy)
    return scene


def _polygon(entry: Entry) -> Polygon:
    corners = entry.items()
    if len(corners) < 3:
        raise entry.fault(f"{len(corners)} corners make no polygon", "List three or more [x, y].")
    return tuple((x, y) for x, y in (corner.numbers(2, _metres) for corner in corners))


def _box(entry: Entry) -> Box:
    parsers = {"class": _class, "centre": _position, "size": _size, "heading": Entry.number}
    values = entry.record(parsers, required=["class", "centre", "size"])
    return Box(values.pop("class"), **values)


def _corrections(entry: Entry) -> Any:
    """The corrections of one sequence, by box."""
    of_box = {"shift": _position, "size": _size, "heading": Entry.number}
    parsers = {"boxes": lambda boxes: boxes.each(lambda box: box.record(of_box))}
    return entry.record(parsers, required=["boxes"])["boxes"]


def _class(entry: Entry) -> TrackClass:
    return CLASS_BY_NAME[entry.one_of(CLASS_BY_NAME)]


def _position(entry: Entry) -> tuple[float, ...]:
    return entry.numbers(3, _metres)


def _size(entry: Entry) -> tuple[float, ...]:
    return entry.numbers(3, _length)


def _metres(entry: Entry) -> float:
    return entry.within(-FARTHEST, FARTHEST)


def _length(entry: Entry) -> float:
    entry.positive()
    return _metres(entry)
