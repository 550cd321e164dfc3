"""A picture of a labelled scan and its scene."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba_array
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Polygon
from numpy.typing import ArrayLike

from derain.annotation.scene import Scene
from derain.annotation.steps import CLASS_NAMES
from derain.fusion import UNKNOWN
from derain.pictures.scan_pictures import legend_below, scatter, titled_figure
from derain.scan import Ints, Scan
from derain.simulation.classes import TrackClass
from derain.views.directions import directions

# On a dark ground, classes of many points are dull and classes of few points bright.
CLASS_COLOURS = {
    TrackClass.BACKGROUND: "#5c6773",
    TrackClass.ROAD: "#a79b8e",
    TrackClass.RAIN: "#39c5ff",
    TrackClass.SPRINKLER: "#b58cff",
    TrackClass.CAR: "#ff5d5d",
    TrackClass.PEDESTRIAN: "#ffd23f",
    TrackClass.BIKE: "#ff9a3c",
    TrackClass.TARGET: "#5ee08a",
    UNKNOWN: "#ff6ad5",
}

# Metres around the road polygon that are drawn from above.
SURROUNDINGS = 3.0


def annotation_figure(scan: Scan, label: Ints, scene: Scene, title: str) -> Figure:
    """One scan coloured by class, from above with road and boxes, and as the sensor sees it.

    Args:
        scan: The scan.
        label: TrackClass or UNKNOWN of every row, int64 (N,).
        scene: The scene it was labelled by.
        title: Heading.
    """
    points, kind = scan.xyz[scan.valid], label[scan.valid]
    colours = np.zeros((UNKNOWN + 1, 4))
    colours[[*CLASS_COLOURS]] = to_rgba_array([*CLASS_COLOURS.values()])
    figure = titled_figure(14, 10, title)
    above, ahead = figure.subplots(2, 1)
    scatter(above, points[:, 0], points[:, 1], colours, kind)
    _draw_scene(above, scene)
    azimuth, inclination = directions(points)
    scatter(ahead, -azimuth, inclination, colours, kind)
    ahead.set(xlabel="azimuth, to the right / °", ylabel="inclination / °")
    legend_below(figure, _legend(kind), ncols=9)
    return figure


def _legend(label: Ints) -> list[Patch]:
    counts = np.bincount(label, minlength=UNKNOWN + 1)
    return [
        Patch(color=colour, label=f"{CLASS_NAMES[kind]} {counts[kind]:,}")
        for kind, colour in CLASS_COLOURS.items()
        if counts[kind]
    ]


def _draw_scene(axes: Axes, scene: Scene) -> None:
    """Draws the outlines of road and boxes from above, in axes that show the road."""
    _outline(axes, scene.road, "white", 0.8)
    if scene.rain_area is not None:
        _outline(axes, scene.rain_area, CLASS_COLOURS[TrackClass.RAIN], 0.8)
    for box in scene.boxes.values():
        _outline(axes, box.corners(), CLASS_COLOURS[box.kind], 0.6)
    road = np.array(scene.rain_area or scene.road)
    (left, bottom), (right, top) = road.min(axis=0), road.max(axis=0)
    axes.set_xlim(left - SURROUNDINGS, right + SURROUNDINGS)
    axes.set_ylim(bottom - SURROUNDINGS, top + SURROUNDINGS)
    axes.set(aspect="equal", xlabel="forward / m", ylabel="left / m")


def _outline(axes: Axes, corners: ArrayLike, colour: str, width: float) -> None:
    axes.add_patch(Polygon(corners, fill=False, edgecolor=colour, linewidth=width))
