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

from pathlib import Path

from derain.annotation.scene import Box, Correction, PlaneSearch, Polygon, Scene, Triple
from derain.errors import InputError
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
        "boxes": lambda entry: entry.each(_box),
        "rain_area": _polygon,
        "height": _metres,
        "plane": _plane_search,
        "corrections": lambda entry: entry.each(_corrections),
    }
    scene = Scene(**Entry.of_yaml(path).record(parsers, required=["road"]))
    for sequence, corrections in scene.corrections.items():
        for name in corrections:
            if name not in scene.boxes:
                raise InputError(
                    f"{path}: corrections.{sequence}.boxes.{name}",
                    "there is no such box",
                    f"Known are {', '.join(scene.boxes)}.",
                )
    return scene


def _polygon(entry: Entry) -> Polygon:
    corners = entry.items()
    if len(corners) < 3:
        raise entry.fault(f"{len(corners)} corners make no polygon", "List three or more [x, y].")
    return tuple((x, y) for x, y in (corner.numbers(2, _metres) for corner in corners))


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


def _corrections(entry: Entry) -> dict[str, Correction]:
    """The corrections of one sequence, by box."""
    parsers = {"boxes": lambda boxes: boxes.each(_correction)}
    corrections: dict[str, Correction] = entry.record(parsers, required=["boxes"])["boxes"]
    return corrections


def _correction(entry: Entry) -> Correction:
    parsers = {"shift": _triple, "size": _size, "heading": Entry.number}
    return Correction(**entry.record(parsers))


def _class(entry: Entry) -> TrackClass:
    if not isinstance(entry.value, str) or entry.value not in CLASS_BY_NAME:
        raise entry.fault(
            f"there is no class {shown(entry.value)}", f"Known are {', '.join(CLASS_BY_NAME)}."
        )
    return CLASS_BY_NAME[entry.value]


def _triple(entry: Entry) -> Triple:
    x, y, z = entry.numbers(3, _metres)
    return x, y, z


def _size(entry: Entry) -> Triple:
    length, width, height = entry.numbers(3, _length)
    return length, width, height


def _metres(entry: Entry) -> float:
    return entry.within(-FARTHEST, FARTHEST)


def _length(entry: Entry) -> float:
    entry.positive()
    return _metres(entry)
