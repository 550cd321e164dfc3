"""Describes a simulated track as a scene, as a person would who annotates it with patience."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from derain.annotation.scene import Box, Polygon, Scene
from derain.annotation.steps import Plane
from derain.scan import Bools, Floats
from derain.simulation.classes import TrackClass
from derain.simulation.sensor import Sensor
from derain.simulation.track import Track
from derain.system.open3d_import import import_open3d

# Corners of triangles this near to each other are one corner, and leaves this near to each other
# belong to one bush, metres.
SAME_CORNER = 1e-3
LEAF_GAP = 0.3

# Boxes end this high above the road, metres, so that few points of the road lie in them.
BOX_CLEARANCE = 0.02

# A box is this many standard deviations of the sensor's range noise wider than what is in it.
BOX_MARGIN = 3.0

# Accuracy of a rectangle's heading, degrees; at 100 m it makes 2 mm.
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

    def corners(self) -> Floats:
        """Its corners x, y in order, float64 (4, 2), metres."""
        halves = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) / 2
        return (halves * self.size) @ _axes(self.heading).T + self.centre


def scene_of_track(track: Track, sensor: Sensor, beside: float = 0.0) -> Scene:
    """Describes a simulated track: its road, and a box around each part of what stands there.

    A part is a set of triangles that hang together. A sprinkler's mast is one part and its arm
    another, because a box around both would hold much rain. Of the background only what reaches
    into the area of the rain gets boxes. They come last, so that a car's box counts where that of a
    bough reaches into it.

    Args:
        track: The track.
        sensor: The sensor that sees it; the scene is in its frame.
        beside: How far beside the road rain is labelled, metres. With 0 it is labelled over the
            road alone, as in the paper.

    Raises:
        InputError: Open3D cannot be imported.
    """
    triangles = track.triangles.astype(np.float64) - (0, 0, sensor.mounting_height)
    asphalt = triangles[track.label == TrackClass.ROAD].reshape(-1, 3)
    road, plane = rectangle_around(asphalt[:, :2]), _plane_near(asphalt)
    area = _widened(road, beside)
    margin = BOX_MARGIN * sensor.range_noise
    boxes = {}
    for kind in sorted(set(TrackClass) - {TrackClass.ROAD, TrackClass.RAIN}, reverse=True):
        of_kind = triangles[track.label == kind]
        if kind is TrackClass.BACKGROUND:
            parts = _bushes(of_kind[_rise_over(area, plane, of_kind)])
        else:
            parts = _connected(of_kind)
        for number, part in enumerate(parts, 1):
            boxes[f"{kind.name.lower()}_{number}"] = _box(kind, part.reshape(-1, 3), margin, plane)
    return Scene(_polygon(road), boxes, _polygon(area) if beside else None)


def rectangle_around(points: Floats) -> Rectangle:
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
    return Rectangle((float(x), float(y)), (float(length), float(width)), heading)


def _axes(heading: float) -> Floats:
    """Directions ahead and left of a heading in degrees as columns, (2, 2)."""
    cosine, sine = np.cos(np.radians(heading)), np.sin(np.radians(heading))
    return np.array([[cosine, -sine], [sine, cosine]])


def _widened(rectangle: Rectangle, margin: float) -> Rectangle:
    """The rectangle with a margin on every side, metres."""
    length, width = rectangle.size
    return replace(rectangle, size=(length + 2 * margin, width + 2 * margin))


def _polygon(rectangle: Rectangle) -> Polygon:
    return tuple((float(x), float(y)) for x, y in rectangle.corners())


def _plane_near(points: Floats) -> Plane:
    """The plane with the least vertical distances from points (N, 3)."""
    x, y, z = points.T
    (level, ahead, left), *_ = np.linalg.lstsq(np.column_stack([np.ones_like(x), x, y]), z)
    length = float(np.sqrt(1 + ahead**2 + left**2))
    return Plane((-ahead / length, -left / length, 1 / length), -level / length)


def _rise_over(area: Rectangle, ground: Plane, triangles: Floats) -> Bools:
    """Which triangles (T, 3, 3) rise above the ground, and may reach into an area."""
    relative = (triangles[..., :2] - area.centre) @ _axes(area.heading)
    reach = np.array(area.size) / 2
    apart = (relative.min(axis=1) > reach) | (relative.max(axis=1) < -reach)
    height = ground.height(triangles.reshape(-1, 3)).reshape(-1, 3).max(axis=1)
    rising: Bools = ~apart.any(axis=1) & (height > BOX_CLEARANCE)
    return rising


def _connected(triangles: Floats) -> list[Floats]:
    """Splits triangles (T, 3, 3) into those that share edges."""
    if not len(triangles):
        return []
    open3d = import_open3d()
    mesh = open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(triangles.reshape(-1, 3)),
        open3d.utility.Vector3iVector(np.arange(3 * len(triangles)).reshape(-1, 3)),
    ).merge_close_vertices(SAME_CORNER)
    return _grouped(triangles, mesh.cluster_connected_triangles()[0])


def _bushes(triangles: Floats) -> list[Floats]:
    """Splits triangles (T, 3, 3) into groups between which there is air."""
    if not len(triangles):
        return []
    open3d = import_open3d()
    centres = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(triangles.mean(axis=1)))
    return _grouped(triangles, centres.cluster_dbscan(LEAF_GAP, min_points=1))


def _grouped(triangles: Floats, group: Any) -> list[Floats]:
    return [triangles[np.asarray(group) == number] for number in np.unique(group)]


def _box(kind: TrackClass, corners: Floats, margin: float, road: Plane) -> Box:
    """A box around corners (N, 3), with a margin on every side but that of the road."""
    footprint = rectangle_around(corners[:, :2])
    x, y = footprint.centre
    bottom, top = corners[:, 2].min(), corners[:, 2].max() + margin
    above_road = float(road.height(np.array([[x, y, bottom]]))[0])
    bottom += max(BOX_CLEARANCE - above_road, -margin)
    size = (*_widened(footprint, margin).size, float(top - bottom))
    return Box(kind, (x, y, float(bottom + top) / 2), size, footprint.heading)
