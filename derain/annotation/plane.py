"""The plane of the road, found by RANSAC."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from derain.errors import InputError
from derain.system.open3d_import import import_open3d

# A road leans less; a wall leans more.
STEEPEST = 30.0

# RANSAC looks at all of its points in every iteration; so many give a plane to the millimetre.
MOST_POINTS = 50_000


@dataclass(frozen=True)
class PlaneSearch:
    """How the plane of the road is sought.

    Attributes:
        distance: A point this near to a plane lies in it, metres.
        points: Points that each candidate is fitted to.
        iterations: Candidates.
        scans: Scans of a sequence that are looked at, evenly spread; the scene stands still.
        seed: Seed of what is drawn.

    Source: distance and points as in the ground removal of sporsho/3DUnOutDet. Its 50,000
    iterations search whole scans, less than half of which is road; over the road polygon most
    points are road: were it only half of them, 1,000 candidates of 9 points would still hold one
    of road alone with 86 %.
    """

    distance: float = 0.1
    points: int = 9
    iterations: int = 1000
    scans: int = 10
    seed: int = 0


@dataclass(frozen=True)
class Plane:
    """A plane whose normal points up: the points p with normal · p + offset = 0.

    Attributes:
        normal: Unit normal, sensor frame.
        offset: Signed height of the sensor above the plane, metres.
    """

    normal: tuple[float, float, float]
    offset: float

    def height(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Signed distance from the plane, positive above it.

        Args:
            points: x, y and z, float64 (N, 3), metres, sensor frame.

        Returns:
            float64 (N,), metres.
        """
        height: NDArray[np.float64] = points @ np.array(self.normal) + self.offset
        return height

    @property
    def slope(self) -> float:
        """How far the plane leans, degrees."""
        return math.degrees(math.acos(min(self.normal[2], 1.0)))


def find_plane(points: NDArray[np.float64], search: PlaneSearch, name: str) -> Plane:
    """Finds the plane that holds the most points.

    Args:
        points: x, y and z, finite, float64 (N, 3), metres, sensor frame.
        search: How it is sought. The same points and search give the same plane.
        name: Where the points come from, for messages.

    Raises:
        InputError: Fewer points than a candidate needs, a plane that is no road's, or Open3D
            cannot be imported.
    """
    if len(points) < search.points:
        raise InputError(
            name,
            f"{len(points)} points over the road are too few for a plane",
            "Check the scene's road polygon, which is in the sensor's frame.",
        )
    if len(points) > MOST_POINTS:
        generator = np.random.default_rng(search.seed)
        points = points[generator.choice(len(points), MOST_POINTS, replace=False)]
    plane = _ransac(points, search)
    if not plane.slope <= STEEPEST:
        raise InputError(
            name,
            f"the plane found leans by {plane.slope:.0f} degrees",
            "Check the scene's road polygon, which is in the sensor's frame.",
        )
    return plane


def _ransac(points: NDArray[np.float64], search: PlaneSearch) -> Plane:
    open3d = import_open3d()
    open3d.utility.random.seed(search.seed)
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
    # Certainty keeps Open3D from stopping early, at a candidate that depends on its threads.
    found, _ = cloud.segment_plane(
        search.distance, search.points, search.iterations, probability=1.0
    )
    a, b, c, d = np.array(found) / (np.linalg.norm(found[:3]) * (-1 if found[2] < 0 else 1))
    return Plane((float(a), float(b), float(c)), float(d))
