"""Evidence of another scan's rays at some places: whether they ended there, or passed through.

Rays of other scans pass the place of a drop, and end at the place of anything solid. It does not
matter how the sensor scans: its rays are where its returns are. Each of two returns of a ray is the
end of a ray of its own: that of a solid thing went through the drop before it.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from derain.scan import Bools, Floats, Ints, Scan
from derain.system.cores import sleeping_threads
from derain.views.morton import distinct_rows

with sleeping_threads():
    import small_gicp

# No sensor measures nearer than this, metres; it keeps every division finite.
NEAREST = 0.01

# The step between the rays of a scan is the median over this many of them, evenly spread.
MOST_RAYS = 5000

# To its third nearest neighbour a ray has a step or two, whichever of the two axes steps finer; the
# nearest may be the other return of the same ray.
STEP_NEIGHBOUR = 3

# Rays of the other scan that are looked up for each place. They lie on two or three of its beams:
# one more drop does not decide.
RAYS = 8

# Rays count that pass a place by no more than this angle, degrees, or by so many steps of a coarser
# sensor. The wider the bound, the more places have rays, and the more rays pass edges.
WITHIN, WITHIN_STEPS = 0.6, 1.8

# A ray that ends at the place: metres, and metres more for each metre of range, by which steps and
# registration make ends differ. One that ends farther behind it than the other bound went through.
ENDS_AT = (0.1, 0.01)
WENT_THROUGH = (0.5, 0.01)

# A ray that passes the place by this angle, degrees, has half the weight of one that meets it. From
# a sensor that stands the same ray comes back, and shows more than all those around it; from one
# that moves no ray passes nearer, because its poses are true to a tenth of a degree.
HALF_WEIGHT_AT = 0.1

# The least sum of weights: where no ray passes near, all of them together count less.
LEAST_WEIGHT = 0.2


class Rays:
    """The rays of a scan, by their directions.

    Args:
        xyz: Ends of the rays, float (M, 3), metres, in the sensor's frame.
        threads: Threads of every search.
        rows: Rows of the scan that they are of, int64 (M,); by default 0 to M - 1.
    """

    def __init__(self, xyz: NDArray[np.floating], threads: int, rows: Ints | None = None) -> None:
        self.rows = np.arange(len(xyz)) if rows is None else rows
        wide = xyz.astype(np.float64)
        self.range = range_of(wide)
        self.directions: Floats = wide / self.range[:, None]
        self._threads = threads
        self._tree = small_gicp.KdTree(self.directions, num_threads=threads) if len(wide) else None

    @classmethod
    def of(cls, scan: Scan, threads: int) -> "Rays":
        """The rays of the distinct valid points of a scan."""
        rows, _ = distinct_rows(scan)
        return cls(scan.xyz[rows], threads, rows)

    def __len__(self) -> int:
        return len(self.range)

    @cached_property
    def step(self) -> float:
        """Angle between neighbouring rays, radians; 0 of fewer rays than that takes."""
        some = slice(None, None, max(1, len(self) // MOST_RAYS))
        if len(self) <= STEP_NEIGHBOUR:
            return 0.0
        _, chords = self.nearest(self.directions[some], STEP_NEIGHBOUR + 1)
        return float(np.median(chords[:, STEP_NEIGHBOUR]))

    def nearest(self, directions: Floats, count: int) -> tuple[Ints, Floats]:
        """The rays that are nearest to some directions.

        Args:
            directions: Unit vectors, float64 (Q, 3), in the frame of this scan's sensor.
            count: Rays to find for each.

        Returns:
            Numbers of rays, int64 (Q, count), and the angles to them, radians, float64 (Q, count);
            where there are fewer, the angles of the missing ones are infinite.
        """
        found = min(count, len(self))
        rays = np.zeros((len(directions), count), np.int64)
        angles = np.full((len(directions), count), np.inf)
        if self._tree is not None and len(directions):
            near, squared = self._tree.batch_knn_search(
                directions, found, num_threads=self._threads
            )
            rays[:, :found] = near
            # The chord of a small angle is the angle.
            angles[:, :found] = np.sqrt(squared)
        return rays, angles


def range_of(xyz: Floats) -> Floats:
    """Distance of places from the origin, metres, float64 (M,); a centimetre at least.

    Args:
        xyz: Coordinates, float64 (M, 3), metres.
    """
    x, y, z = np.ascontiguousarray(xyz.T)
    return np.asarray(np.maximum(np.sqrt(x * x + y * y + z * z), NEAREST))


@dataclass(frozen=True, eq=False)
class RayEvidence:
    """The evidence of the rays of another scan, or of several, at M places.

    Attributes:
        ending: Share of the rays near a place that end at something solid there, float64 (M,),
            weighted by how near they pass.
        through: Share of them that went through it to something behind, float64 (M,).
    """

    ending: Floats
    through: Floats

    def __getitem__(self, places: slice | Bools) -> "RayEvidence":
        """The evidence at some of the places."""
        return RayEvidence(self.ending[places], self.through[places])


def ray_evidence(
    places: Floats, rays: Rays, step: float, solid: Floats | None = None
) -> RayEvidence:
    """Finds how the rays of a scan pass some places.

    Args:
        places: float64 (M, 3), metres, in the frame of the rays.
        rays: The rays.
        step: Angle between the beams of the scan that the places are of, radians.
        solid: How far each ray counts as one that ends at something solid, 0..1, float64 (R,); by
            default, all count whole.

    Returns:
        The evidence; zeros where no ray is near.
    """
    if not len(rays):
        return RayEvidence(np.zeros(len(places)), np.zeros(len(places)))
    reach = range_of(places)
    near_rays, angles = rays.nearest(places / reach[:, None], RAYS)
    near = angles <= max(np.radians(WITHIN), WITHIN_STEPS * step)
    behind = rays.range.take(near_rays) - reach[:, None]
    at, through = (offset + slope * reach[:, None] for offset, slope in (ENDS_AT, WENT_THROUGH))
    ending = (np.abs(behind) <= at).astype(np.float64)
    if solid is not None:
        ending *= solid[near_rays]
    weight = near / (1 + np.square(angles / np.radians(HALF_WEIGHT_AT)))
    # einsum adds up short rows several times faster than a sum along the axis.
    total_weight = np.maximum(np.einsum("ij->i", weight), LEAST_WEIGHT)
    return RayEvidence(
        np.einsum("ij,ij->i", weight, ending) / total_weight,
        np.einsum("ij,ij->i", weight, behind > through) / total_weight,
    )


def mean_evidence(evidence: list[RayEvidence]) -> RayEvidence:
    """The mean of the evidence of several scans, at least one."""
    return RayEvidence(
        np.mean([one.ending for one in evidence], axis=0),
        np.mean([one.through for one in evidence], axis=0),
    )
