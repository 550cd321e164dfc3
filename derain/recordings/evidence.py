"""Evidence of rain at each point: rays of other scans, its surroundings, and its neighbours.

Rays of other scans pass the place of a drop, and end at the place of anything solid. In its own
scan a drop has nothing near it, and lies on no surface. The log-odds of both are added, as of two
independent witnesses, with weights fitted to simulated drives, whose truth is known
(``benchmarks/persistence_weights.py``): no label of a real scan and no intensity is used. Then each
point and its neighbours vote, because drops fly among drops and surfaces hang together.
"""

from functools import cached_property
from typing import Self

import numpy as np

from derain.recordings.rays import RayEvidence, Rays, ray_evidence
from derain.scan import Floats, Scan
from derain.views.morton import distinct_rows
from derain.views.neighbour_search import NeighbourSearch
from derain.views.scatter import scatter_through_space

# Points of a neighbourhood, the point itself included, as in 3D-OutDet.
NEIGHBOURS = 9

# What is added before a logarithm is taken, and what then takes the usual value to 0.
STEP_EPSILON, USUAL_STEPS = 1e-3, 1.0
FLATTEST, USUAL_SCATTER, SPREAD_OF_SCATTER = 1e-4, -4.5, 2.0
USUAL_RANGE = 10.0

# The least step between rays, radians: a scan of a smaller one has too few points.
LEAST_STEP = 1e-5

# Log-odds of rain: of any point; for each share of rays that end at it, and that went through.
RAY_WEIGHTS = (-1.41, -9.29, 3.94)

# Log-odds of rain for each of ``surroundings_features``, in that order.
SURROUNDINGS_WEIGHTS = (-3.13, 7.13, 1.76, -1.27, -2.06, -0.31, -3.63, -0.79, -3.71, -1.97)

# Log-odds of rain in the simulated drives. Both witnesses include them, the sum only once.
PRIOR = -2.49

# A neighbour at this distance has half the weight of the point itself: metres, and metres more for
# each metre of range, a step of a sensor of 64 beams.
HALF_AT = (0.1, 0.01)

# The bound on the vote of a single point, log-odds: beyond it, a point outvotes no more neighbours.
LARGEST_LOG_ODDS = 4.0


class ScanPoints:
    """The M distinct positions of a scan that can be judged, along a Morton curve.

    Args:
        scan: The scan.
        threads: Threads of every search.

    Attributes:
        xyz: Coordinates, float64 (M, 3), metres, in the sensor's frame.
        inverse: Point of each row of the scan, int64 (N,); -1 for rows that cannot be judged.
        neighbours: Of each point itself and its nearest neighbours, rows of ``xyz``, int64 (M, k).
        distances: Their distances, metres, float64 (M, k).
    """

    def __init__(self, scan: Scan, threads: int) -> None:
        first, self.inverse = distinct_rows(scan)
        xyz = scan.xyz.take(first, axis=0)
        search = NeighbourSearch(xyz, rank=first, threads=threads)
        self.neighbours, distances = search(NEIGHBOURS)
        self.distances = distances.astype(np.float64)
        self.xyz = xyz.astype(np.float64)
        self._threads = threads

    def __len__(self) -> int:
        return len(self.xyz)

    def evidence_of(
        self, other: Self, to_other: Floats, solid: Floats | None = None
    ) -> RayEvidence:
        """The evidence of another scan's rays at the points of this one.

        Args:
            other: The other scan.
            to_other: Takes the frame of this scan to that of the other, float64 (4, 4), metres.
            solid: As of :func:`ray_evidence`.
        """
        places = self.xyz @ to_other[:3, :3].T + to_other[:3, 3]
        return ray_evidence(places, other.rays, self.rays.step, solid)

    @cached_property
    def rays(self) -> Rays:
        """The rays that end at the points."""
        return Rays(self.xyz, self._threads)


def surroundings_features(points: ScanPoints) -> Floats:
    """Describes the surroundings of each point by three numbers, their squares and products.

    The numbers are logarithms: of the mean distance of a point's neighbours in steps of the
    sensor's rays at its range; of the smallest eigenvalue of their covariance over the sum of all
    three, which is 0 on a surface; and of its range. None of them depends on the sensor.

    Args:
        points: M points of a scan.

    Returns:
        One, the numbers, and their six squares and products, float64 (M, 10), finite.
    """
    step = max(points.rays.step, LEAST_STEP)
    steps_apart = points.distances[:, 1:].mean(axis=1) / (points.rays.range * step)
    scatter = scatter_through_space(points.xyz, points.neighbours)
    apart = np.log(steps_apart + STEP_EPSILON) - USUAL_STEPS
    rough = (np.log(scatter + FLATTEST) - USUAL_SCATTER) / SPREAD_OF_SCATTER
    far = np.log(points.rays.range / USUAL_RANGE)
    products = apart**2, rough**2, far**2, apart * rough, apart * far, rough * far
    return np.stack([np.ones_like(apart), apart, rough, far, *products], axis=1)


def surroundings_log_odds(points: ScanPoints) -> Floats:
    """Log-odds of rain of each of M points by its surroundings alone, float64 (M,)."""
    return np.asarray(surroundings_features(points) @ np.array(SURROUNDINGS_WEIGHTS))


def combined_log_odds(surroundings: Floats, evidence: RayEvidence) -> Floats:
    """Log-odds of rain of each point without its neighbours' votes, float64 (M,).

    Args:
        surroundings: Those by the surroundings of M points, float64 (M,).
        evidence: That of the rays of other scans.
    """
    any_point, ending, through = RAY_WEIGHTS
    by_rays = any_point + ending * evidence.ending + through * evidence.through
    return surroundings + by_rays - PRIOR


def vote(points: ScanPoints, log_odds: Floats) -> Floats:
    """Log-odds of rain of each point and its neighbours together.

    Args:
        points: M points.
        log_odds: Those of each point by itself, float64 (M,).

    Returns:
        float64 (M,).
    """
    offset, slope = HALF_AT
    half_at = (offset + slope * points.rays.range)[:, None]
    weight = 1 / (1 + np.square(points.distances / half_at))
    votes = np.clip(log_odds, -LARGEST_LOG_ODDS, LARGEST_LOG_ODDS).take(points.neighbours)
    return np.asarray(np.einsum("ij,ij->i", weight, votes))
