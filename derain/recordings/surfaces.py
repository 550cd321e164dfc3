"""The surfaces of a scan, thinned out, and how one scan's are laid upon another's."""

from dataclasses import dataclass

import numpy as np

from derain.scan import Floats, Scan
from derain.system.cores import sleeping_threads
from derain.views.morton import distinct_rows, evenly

with sleeping_threads():
    import small_gicp

# Edge of the cubes of which one point is kept each, metres; and how far from the sensor points are
# taken: nearer ones are of the vehicle itself, or drops, and farther ones are few and apart.
VOXEL = 0.5
NEAREST, FARTHEST = 5.0, 80.0

# Points that are looked at. More hold the scans back, for the rings that the beams draw on the
# ground go along with the sensor: over four scans of WADS all of its points lead 4 cm from where
# the first and the last of them lie upon one another directly, and every second point leads 2 cm.
MOST_REGISTERED = 100_000

# Points that a surface is fitted to, and thickness that GICP gives it where it is 1 wide: both as
# small_gicp has them.
# Source: A. Segal, D. Haehnel, S. Thrun, "Generalized-ICP", RSS 2009: epsilon = 0.001.
POINTS_OF_A_SURFACE = 10
THICKNESS = 1e-3

# Steps of the search; it comes to rest in one to four where it starts near, in fourteen from 4 m.
MOST_ITERATIONS = 20

# How far apart partners may be whose distances measure the fit of two scans, metres.
PARTNERS = 1.5

# With fewer surfaces nothing is laid upon anything. Of indoor scans, moved by known motions through
# 2 cm of noise, those with 75 to 128 surfaces were 22 cm off at worst, those with 287 or more 2 cm.
FEWEST_SURFACES = 200


@dataclass(frozen=True)
class Fit:
    """The fit of one scan's surfaces to another's.

    Attributes:
        motion: Takes the first one's frame to that of the other, float64 (4, 4), metres.
        converged: True if the search for it converged.
        residual: Median distance between partners across their surface, metres; NaN without any.
        matched: Share of surfaces with a partner within a voxel, 0..1.
        facing: Share of partners that hold the motion in the direction in which it is held least,
            0..1: of a flat road alone, along which scans slide, it is 0.
    """

    motion: Floats
    converged: bool
    residual: float
    matched: float
    facing: float


class Surfaces:
    """A scan's surfaces: one point a voxel, and which way it faces.

    All sums over points are by one thread, in one order: what comes out does not depend on how many
    threads there are, to the last bit.

    Args:
        scan: The scan. Only distinct positions count.
        threads: Threads that surfaces are fitted with.
    """

    def __init__(self, scan: Scan, threads: int) -> None:
        self._threads = threads
        points = small_gicp.PointCloud(_points_in_reach(scan))
        self._cloud = small_gicp.voxelgrid_sampling(points, VOXEL)
        self._tree = None
        if self.are_enough:
            self._tree = small_gicp.KdTree(self._cloud, num_threads=threads)
            small_gicp.estimate_normals_covariances(
                self._cloud, self._tree, POINTS_OF_A_SURFACE, threads
            )

    def __len__(self) -> int:
        return int(self._cloud.size())

    @property
    def are_enough(self) -> bool:
        """True if anything can be laid upon them."""
        return len(self) >= FEWEST_SURFACES

    def onto(self, other: "Surfaces", start: Floats, within: float) -> Fit:
        """Lays these surfaces upon those of another scan.

        Args:
            other: Those of the other scan. Both must be enough.
            start: Motion to begin with, float64 (4, 4), metres.
            within: Largest distance between partners, metres.

        Source: A. Segal, D. Haehnel, S. Thrun, "Generalized-ICP", RSS 2009.
        """
        found = small_gicp.align(
            other._cloud,
            self._cloud,
            other._tree,
            start,
            max_correspondence_distance=within,
            max_iterations=MOST_ITERATIONS,
        )
        motion = np.array(found.T_target_source, np.float64)
        residual, matched = self._distances(other, motion)
        return Fit(motion, found.converged, residual, matched, _facing(found))

    def _distances(self, other: "Surfaces", motion: Floats) -> tuple[float, float]:
        """Median distance of partners across their surface, and the share within a voxel."""
        moved = self._cloud.points()[:, :3] @ motion[:3, :3].T + motion[:3, 3]
        assert other._tree is not None  # they are enough
        rows, squared = other._tree.batch_knn_search(moved, 1, num_threads=self._threads)
        rows, squared = rows[:, 0], squared[:, 0]
        apart = moved - other._cloud.points()[rows, :3]
        across = np.einsum("ij,ij->i", apart, other._cloud.normals()[rows, :3])
        partners = squared <= PARTNERS**2
        residual = float(np.median(np.abs(across[partners]))) if partners.any() else np.nan
        return residual, float((squared <= VOXEL**2).mean())


def _points_in_reach(scan: Scan) -> Floats:
    """Distinct positions neither too near nor too far, spread over the scan, float64 (M, 3)."""
    rows, _ = distinct_rows(scan)
    distance = scan.range[rows]
    rows = rows[(distance > NEAREST) & (distance < FARTHEST)]
    return scan.xyz.take(evenly(rows, MOST_REGISTERED), axis=0).astype(np.float64)


def _facing(found: "small_gicp.RegistrationResult") -> float:
    """Share of partners that hold the motion where it is held least.

    GICP adds up, partner by partner, the inverse of C = c₁ + R c₂ Rᵀ, and of a flat surface c is 1
    along it and THICKNESS across. So a partner holds its own direction by 1 / (2 THICKNESS) and the
    others by 1/2, and the smallest eigenvalue of the sum, a partner, lies between the two.
    """
    if not found.num_inliers:
        return 0.0
    least = float(np.linalg.eigvalsh(found.H[3:, 3:])[0]) / found.num_inliers
    along, across = 1 / 2, 1 / (2 * THICKNESS)
    facing: float = max(0.0, (least - along) / (across - along))
    return facing
