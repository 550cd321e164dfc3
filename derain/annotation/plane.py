"""The plane of the road, found by RANSAC."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from derain.errors import InputError
from derain.system.open3d_import import import_open3d

# A steeper plane is a wall and not a road, degrees.
STEEPEST = 30.0

# RANSAC compares every candidate with all points. This many, drawn at random, give the plane to the
# millimetre.
MOST_POINTS = 50_000


@dataclass(frozen=True)
class PlaneSearch:
    """Parameters of the search for the road's plane.

    Attributes:
        distance: A point this near to a plane counts as lying in it, metres.
        points: Number of points that each candidate plane is fitted to.
        iterations: Number of candidate planes.
        scans: Number of scans of a sequence to search, evenly spread. A few are enough, because the
            scene does not move.
        seed: Seed of the random generators.

    Source: distance and points as in the ground removal of sporsho/3DUnOutDet. Its 50,000
    iterations search whole scans, less than half of which is road. Over the road polygon most
    points are road. Even if only half of them were, one of 1,000 candidates of 9 points would be
    fitted to points of the road alone with a probability of 86 %.
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
        """Angle to the horizontal, degrees."""
        return math.degrees(math.acos(min(self.normal[2], 1.0)))


def find_plane(points: NDArray[np.float64], search: PlaneSearch, name: str) -> Plane:
    """Finds the plane that holds the most points.

    Args:
        points: x, y and z, finite, float64 (N, 3), metres, sensor frame.
        search: Parameters. The same points and parameters give the same plane.
        name: Where the points come from, for messages.

    Raises:
        InputError: Fewer points than a candidate needs, a plane too steep for a road, or Open3D
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
            f"the plane found is inclined by {plane.slope:.0f} degrees",
            "Check the scene's road polygon, which is in the sensor's frame.",
        )
    return plane


def _ransac(points: NDArray[np.float64], search: PlaneSearch) -> Plane:
    open3d = import_open3d()
    open3d.utility.random.seed(search.seed)
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
    # With a probability of 1 Open3D tries all candidates. With less it would stop early, at a
    # candidate that depends on how its threads happen to run.
    found, _ = cloud.segment_plane(
        search.distance, search.points, search.iterations, probability=1.0
    )
    a, b, c, d = np.array(found) / (np.linalg.norm(found[:3]) * (-1 if found[2] < 0 else 1))
    return Plane((float(a), float(b), float(c)), float(d))
