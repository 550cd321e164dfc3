"""A scan's distinct points with their neighbours, and its rays by their directions."""

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from derain.recordings.rays import RayEvidence, Rays, range_of, ray_evidence
from derain.scan import Scan
from derain.views.morton import distinct_rows
from derain.views.neighbour_search import NeighbourSearch

# Points of a neighbourhood, the point itself included, as in 3D-OutDet.
NEIGHBOURS = 9


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

    def evidence_of(
        self,
        other: Self,
        to_other: NDArray[np.float64],
        at_drops: NDArray[np.bool_] | None = None,
    ) -> RayEvidence:
        """What the rays of another scan show at the points of this one.

        Args:
            other: The other scan.
            to_other: Takes the frame of this scan to that of the other, float64 (4, 4), metres.
            at_drops: As of :func:`ray_evidence`.
        """
        places = self.xyz @ to_other[:3, :3].T + to_other[:3, 3]
        return ray_evidence(places, other.rays, self.rays.step, at_drops)

    @cached_property
    def rays(self) -> Rays:
        """The rays that end at the points."""
        return Rays(self.xyz, self.threads)
