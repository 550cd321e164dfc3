"""Scene files: a static scene as YAML.

    height: 0.1                                  # metres; points higher above the road are rain
    road: [[2, -4], [60, -4], [60, 4], [2, 4]]   # corners x, y in order, metres, sensor frame
    boxes:
      car_1: {class: car, centre: [20, 1, -0.6], size: [4.5, 1.8, 1.5], heading: 5}
      mast_1: {class: sprinkler, centre: [8, 4.5, 0.7], size: [0.3, 0.3, 4]}
    plane: {distance: 0.1, points: 9, iterations: 1000, scans: 10, seed: 0}
    corrections:                                 # of boxes in some sequences
      "003": {boxes: {car_1: {shift: [0.2, 0, 0]}}}

Only the road is required. Where it rains beside the road, `rain_area` lists the corners of the area
in which drops are labelled. A correction may have shift, size and heading.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from derain.annotation.plane import PlaneSearch
from derain.annotation.scene import Box, Correction, Polygon, Scene, Triple
from derain.files.documents import Entry, shown
from derain.simulation.classes import TrackClass

# Most points that a candidate plane may be fitted to: more make it no better, and make it less
# likely that all of them are road.
MOST_FITTED = 100

# Largest coordinate and length, metres: beyond the range of any LiDAR, and a product of three does
# not overflow.
FARTHEST = 1e6

# Open3D's whole numbers have 32 bits.
LARGEST_INTEGER = 2**31 - 1

CLASS_BY_NAME = {kind.name.lower(): kind for kind in TrackClass}


def read_scene(path: Path) -> Scene:
    """Reads a scene file.

    Raises:
        InputError: A file that cannot be read, or an invalid value in it; the message names its
            key.
    """
    parsers = {
        "road": _polygon,
        "boxes": _boxes,
        "rain_area": _polygon,
        "height": _metres,
        "plane": _plane_search,
        "corrections": _itself,
    }
    values = Entry.of_yaml(path).record(parsers, required=["road"])
    corrections = values.pop("corrections", None)
    scene = Scene(**values)
    if corrections is None:
        return scene
    return replace(
        scene,
        corrections={
            sequence: _corrections(entry, scene.boxes)
            for sequence, entry in corrections.members().items()
        },
    )


def _polygon(entry: Entry) -> Polygon:
    corners = entry.items()
    if len(corners) < 3:
        raise entry.fault(f"{len(corners)} corners make no polygon", "List three or more [x, y].")
    return tuple((x, y) for x, y in (_place(corner, 2) for corner in corners))


def _boxes(entry: Entry) -> dict[str, Box]:
    return {name: _box(each) for name, each in entry.members().items()}


def _box(entry: Entry) -> Box:
    parsers = {"class": _class, "centre": _triple, "size": _size, "heading": Entry.number}
    values = entry.record(parsers, required=["class", "centre", "size"])
    return Box(values.pop("class"), **values)


def _plane_search(entry: Entry) -> PlaneSearch:
    parsers = {
        "distance": _length,
        "points": lambda value: value.whole(3, MOST_FITTED),
        "iterations": lambda value: value.whole(1, LARGEST_INTEGER),
        "scans": lambda value: value.whole(1, LARGEST_INTEGER),
        "seed": lambda value: value.whole(0, LARGEST_INTEGER),
    }
    return PlaneSearch(**entry.record(parsers))


def _corrections(entry: Entry, boxes: Mapping[str, Box]) -> dict[str, Correction]:
    corrections: Entry = entry.record({"boxes": _itself}, required=["boxes"])["boxes"]
    for name, correction in corrections.members().items():
        if name not in boxes:
            raise correction.fault("there is no such box", f"Known are {', '.join(boxes)}.")
    parsers = {"shift": _triple, "size": _size, "heading": Entry.number}
    return {
        name: Correction(**correction.record(parsers))
        for name, correction in corrections.members().items()
    }


def _itself(entry: Entry) -> Entry:
    """Keeps a value for later: corrections name boxes, which are read first."""
    return entry


def _class(entry: Entry) -> TrackClass:
    if not isinstance(entry.value, str) or entry.value not in CLASS_BY_NAME:
        raise entry.fault(
            f"there is no class {shown(entry.value)}", f"Known are {', '.join(CLASS_BY_NAME)}."
        )
    return CLASS_BY_NAME[entry.value]


def _triple(entry: Entry) -> Triple:
    x, y, z = _place(entry, 3)
    return x, y, z


def _size(entry: Entry) -> Triple:
    size = _triple(entry)
    for side in entry.items():
        side.positive()
    return size


def _place(entry: Entry, axes: int) -> tuple[float, ...]:
    entry.numbers(axes)
    return tuple(map(_metres, entry.items()))


def _metres(entry: Entry) -> float:
    return entry.within(-FARTHEST, FARTHEST)


def _length(entry: Entry) -> float:
    entry.positive()
    return _metres(entry)
