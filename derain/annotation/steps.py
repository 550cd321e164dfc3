"""The steps that label a scan of a static scene by the positions of its points.

Source: REHEARSE-3D, section III.B. Step by step:

1. Scans are read by `derain.files`.
2. The road's plane: `road_plane`.
3. Points in boxes of sprinklers; those below the plane are omitted: `annotate`.
4. Points in boxes of other objects: `annotate`.
5. A polygon around the road: `Scene.road`.
6. Points above the plane, over the polygon and in no box are rain: `annotate`.
7. Other points over the polygon are road: `annotate`.
8. All other points are background: `annotate`.
9. Boxes are corrected by sequence: `Scene.in_sequence`.
10. Points of the radar take the label of the nearest LiDAR point: `derain.fusion`.

No row is dropped: points that the paper omits, and invalid rows, are unknown here.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from derain.annotation.scene import Scene, inside
from derain.errors import InputError
from derain.fusion import UNKNOWN
from derain.scan import Floats, Ints, Scan
from derain.simulation.classes import TrackClass
from derain.system.open3d_import import import_open3d

# Names of the labels, by id.
CLASS_NAMES = {kind.value: kind.name.lower() for kind in TrackClass} | {UNKNOWN: "unknown"}

NO_BOX = -1

# More than the rounding errors of a box's corners, metres.
CORNER_TOLERANCE = 1e-6

# A steeper plane is a wall and not a road, degrees.
STEEPEST = 30.0

# The search for the road's plane, by RANSAC: how near to the plane a point of it lies, metres, how
# many points each candidate is fitted to, and the number of candidates.
# Source: distance and points as in the ground removal of sporsho/3DUnOutDet. Its 50,000 candidates
# search whole scans, less than half of which is road. Over the road polygon most points are road.
# Even if only half of them were, one of 1,000 candidates of 9 points would be fitted to points of
# the road alone with a probability of 86 %.
PLANE_DISTANCE, POINTS_OF_A_PLANE, PLANES = 0.1, 9, 1000

# RANSAC compares every candidate with all points. This many, drawn at random, give the plane to the
# millimetre.
MOST_POINTS = 50_000

# Scans of a sequence that are searched for the plane, evenly spread. A few are enough, because the
# scene does not move.
SCANS_OF_A_PLANE = 10


@dataclass(frozen=True)
class Plane:
    """A plane whose normal points up: the points p with normal · p + offset = 0.

    Attributes:
        normal: Unit normal, sensor frame.
        offset: Signed height of the sensor above the plane, metres.
    """

    normal: tuple[float, float, float]
    offset: float

    def height(self, points: Floats) -> Floats:
        """Signed distance from the plane, positive above it.

        Args:
            points: x, y and z, float64 (N, 3), metres, sensor frame.

        Returns:
            float64 (N,), metres.
        """
        return np.asarray(points @ np.array(self.normal) + self.offset)

    @property
    def slope(self) -> float:
        """Angle to the horizontal, degrees."""
        return math.degrees(math.acos(min(self.normal[2], 1.0)))


def road_plane(scans: Sequence[Scan], scene: Scene) -> Plane:
    """Finds the plane of the road in the scans of one sequence.

    The paper searches all points. Here only points over the road polygon and outside boxes are
    used, most of which are road, so that no wall is found instead. The same scans give the same
    plane.

    Args:
        scans: One or more scans of the sequence.
        scene: The scene as it is in that sequence.

    Raises:
        InputError: Too few points over the road, or a plane too steep for a road, or Open3D cannot
            be imported.
    """
    points = np.concatenate([_bare_road(scan, scene) for scan in scans])
    points = points[np.lexsort(points.T)]  # what is drawn must not depend on the order of rows
    remedy = "Check the scene's road polygon, which is in the sensor's frame."
    if len(points) < POINTS_OF_A_PLANE:
        reason = f"{len(points)} points over the road are too few for a plane"
        raise InputError(scans[0].name, reason, remedy)
    if len(points) > MOST_POINTS:
        chosen = np.random.default_rng(0).choice(len(points), MOST_POINTS, replace=False)
        points = points[chosen]
    plane = _ransac(points)
    if not plane.slope <= STEEPEST:
        reason = f"the plane found is inclined by {plane.slope:.0f} degrees"
        raise InputError(scans[0].name, reason, remedy)
    return plane


def _ransac(points: Floats) -> Plane:
    """The plane that holds the most points, float64 (N, 3), metres."""
    open3d = import_open3d()
    open3d.utility.random.seed(0)
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
    # With a probability of 1 Open3D tries all candidates. With less it would stop early, at a
    # candidate that depends on how its threads happen to run.
    found, _ = cloud.segment_plane(PLANE_DISTANCE, POINTS_OF_A_PLANE, PLANES, probability=1.0)
    a, b, c, d = np.array(found) / (np.linalg.norm(found[:3]) * (-1 if found[2] < 0 else 1))
    return Plane((float(a), float(b), float(c)), float(d))


def annotate(scan: Scan, scene: Scene, plane: Plane) -> Ints:
    """Labels the points of a scan.

    Where boxes overlap, a sprinkler's box counts, otherwise the first in the scene.

    Args:
        scan: The scan.
        scene: The scene as it is in the scan's sequence.
        plane: The plane of its road.

    Returns:
        TrackClass of every row, int64 (N,); UNKNOWN for invalid rows, and for points
        in a sprinkler's box but below the road's plane.
    """
    label = np.full(len(scan), UNKNOWN, dtype=np.int64)
    points = scan.xyz[scan.valid].astype(np.float64)
    boxed, height = _boxed(points, scene), plane.height(points)
    in_rain = inside(scene.rain_area or scene.road, points)
    label[scan.valid] = np.select(
        [
            (boxed == TrackClass.SPRINKLER) & (height < 0),
            boxed != NO_BOX,
            in_rain & (height > scene.height),
            inside(scene.road, points),
        ],
        [UNKNOWN, boxed, TrackClass.RAIN, TrackClass.ROAD],
        TrackClass.BACKGROUND,
    )
    return label


def _bare_road(scan: Scan, scene: Scene) -> Floats:
    """Points over the road and in no box, float64 (M, 3), metres."""
    points = scan.xyz[scan.valid].astype(np.float64)
    points = points[inside(scene.road, points)]
    return np.asarray(points[_boxed(points, scene) == NO_BOX])


def _boxed(points: Floats, scene: Scene) -> Ints:
    """Class of the box that each point is in, int64 (N,); NO_BOX where it is in none."""
    # Sorted by x, so that a box is compared only with the points in its span of x.
    order = np.argsort(points[:, 0])
    points = points[order]
    kind = np.full(len(points), NO_BOX, dtype=np.int64)
    by_rank = sorted(scene.boxes.values(), key=lambda box: box.kind is not TrackClass.SPRINKLER)
    for box in reversed(by_rank):  # later boxes overwrite earlier ones
        x = box.corners()[:, 0]
        span = x.min() - CORNER_TOLERANCE, x.max() + CORNER_TOLERANCE
        first, last = np.searchsorted(points[:, 0], span)
        kind[first:last][box.contains(points[first:last])] = box.kind
    in_order = np.empty_like(kind)
    in_order[order] = kind
    return in_order
