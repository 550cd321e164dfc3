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

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from derain.annotation.plane import Plane, find_plane
from derain.annotation.scene import Scene, inside
from derain.fusion import UNKNOWN
from derain.scan import Scan
from derain.simulation.classes import TrackClass

NO_BOX = -1

# More than the rounding errors of a box's corners, metres.
CORNER_TOLERANCE = 1e-6


def road_plane(scans: Sequence[Scan], scene: Scene) -> Plane:
    """Finds the plane of the road in the scans of one sequence.

    The paper searches all points. Here only points over the road polygon and outside boxes are
    used, most of which are road, so that no wall is found instead.

    Args:
        scans: One or more scans of the sequence.
        scene: The scene as it is in that sequence.

    Raises:
        InputError: Too few points over the road, or a plane too steep for a road, or Open3D cannot
            be imported.
    """
    return find_plane(
        np.concatenate([_bare_road(scan, scene) for scan in scans]), scene.plane, scans[0].name
    )


def annotate(scan: Scan, scene: Scene, plane: Plane) -> NDArray[np.int64]:
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


def _bare_road(scan: Scan, scene: Scene) -> NDArray[np.float64]:
    """Points over the road and in no box, float64 (M, 3), metres."""
    points = scan.xyz[scan.valid].astype(np.float64)
    points = points[inside(scene.road, points)]
    bare: NDArray[np.float64] = points[_boxed(points, scene) == NO_BOX]
    return bare


def _boxed(points: NDArray[np.float64], scene: Scene) -> NDArray[np.int64]:
    """Class of the box that each point is in, int64 (N,); NO_BOX where it is in none."""
    # Sorted by x, so that a box is compared only with the points in its span of x.
    order = np.argsort(points[:, 0])
    points = points[order]
    kind = np.full(len(points), NO_BOX, dtype=np.int64)
    by_rank = sorted(scene.boxes.values(), key=lambda box: box.kind is not TrackClass.SPRINKLER)
    for box in reversed(by_rank):  # later boxes overwrite earlier ones
        x = box.footprint.corners()[:, 0]
        span = x.min() - CORNER_TOLERANCE, x.max() + CORNER_TOLERANCE
        first, last = np.searchsorted(points[:, 0], span)
        kind[first:last][box.contains(points[first:last])] = box.kind
    in_order = np.empty_like(kind)
    in_order[order] = kind
    return in_order
