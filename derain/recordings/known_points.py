"""A scan's distinct points with their neighbours, and its rays by their directions."""

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from derain.scan import Scan
from derain.system.cores import sleeping_threads
from derain.views.morton import distinct_rows
from derain.views.neighbour_search import NeighbourSearch

with sleeping_threads():
    import small_gicp

# Points of a neighbourhood, the point itself included, as in 3D-OutDet.
NEIGHBOURS = 9

# No sensor measures nearer than this, metres; it keeps every division finite.
NEAREST = 0.01

# Of so many points, evenly spread over a scan, the step of its rays is the median.
MOST_RAYS = 5000

# To its third nearest neighbour a ray has a step or two, whichever of the two axes steps finer; the
# nearest may be the other return of the same ray.
STEP_NEIGHBOUR = 3


@dataclass(frozen=True, eq=False)
class ScanPoints:
    """The M distinct positions of a scan that can be judged, along a Morton curve.

    Attributes:
        xyz: Coordinates, float64 (M, 3), metres, in the sensor's frame.
        inverse: Point of each row of the scan, int64 (N,); -1 for rows that cannot be judged.
        neighbours: Of each point itself and its nearest neighbours, rows of ``xyz``, int64 (M, k).
        distances: Their distances, metres, float64 (M, k).
        threads: Threads of every search.
    """

    xyz: NDArray[np.float64]
    inverse: NDArray[np.int64]
    neighbours: NDArray[np.int64]
    distances: NDArray[np.float64]
    threads: int

    @classmethod
    def of(cls, scan: Scan, threads: int) -> Self:
        """Finds the points of a scan and their neighbours.

        Args:
            scan: The scan.
            threads: Threads of every search.
        """
        first, inverse = distinct_rows(scan)
        xyz = scan.xyz.take(first, axis=0)
        neighbours, distances = NeighbourSearch(xyz, rank=first, threads=threads)(NEIGHBOURS)
        return cls(
            xyz.astype(np.float64), inverse, neighbours, distances.astype(np.float64), threads
        )

    def __len__(self) -> int:
        return len(self.xyz)

    @cached_property
    def range(self) -> NDArray[np.float64]:
        """Distance from the sensor, metres, float64 (M,); a centimetre at least."""
        return range_of(self.xyz)

    @cached_property
    def step(self) -> float:
        """Angle between neighbouring rays of the scan, radians; 0 of fewer rays than that takes."""
        some = slice(None, None, max(1, len(self) // MOST_RAYS))
        if len(self) <= STEP_NEIGHBOUR:
            return 0.0
        _, chords = self.rays_near(self._directions[some], STEP_NEIGHBOUR + 1)
        return float(np.median(chords[:, STEP_NEIGHBOUR]))

    def rays_near(
        self, directions: NDArray[np.float64], count: int
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """The rays of this scan that are nearest to some directions.

        Args:
            directions: Unit vectors, float64 (Q, 3), in the frame of this scan's sensor.
            count: Rays to find for each.

        Returns:
            Points at the ends of the rays, int64 (Q, count), and the angles to them, radians,
            float64 (Q, count); where there are fewer, the angles of the missing ones are infinite.
        """
        found = min(count, len(self))
        rays = np.zeros((len(directions), count), np.int64)
        angles = np.full((len(directions), count), np.inf)
        if found and len(directions):
            near, squared = self._tree.batch_knn_search(directions, found, num_threads=self.threads)
            rays[:, :found] = near
            # The chord of a small angle is the angle.
            angles[:, :found] = np.sqrt(squared)
        return rays, angles

    @cached_property
    def _directions(self) -> NDArray[np.float64]:
        """Unit vectors from the sensor, float64 (M, 3)."""
        directions: NDArray[np.float64] = self.xyz / self.range[:, None]
        return directions

    @cached_property
    def _tree(self) -> "small_gicp.KdTree":
        return small_gicp.KdTree(self._directions, num_threads=self.threads)


def range_of(xyz: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance of places from the origin, metres, float64 (M,); a centimetre at least.

    Args:
        xyz: Coordinates, float64 (M, 3), metres.
    """
    x, y, z = np.ascontiguousarray(xyz.T)
    distance: NDArray[np.float64] = np.maximum(np.sqrt(x * x + y * y + z * z), NEAREST)
    return distance
