"""The neighbour view: every point of a scan with its nearest neighbours."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, ClassVar, Self

import numpy as np
import small_gicp
from numpy.typing import NDArray

from derain.files.documents import Entry
from derain.scan import Scan
from derain.system.cores import usable_cores
from derain.views.channels import filled_values
from derain.views.morton import distinct_rows
from derain.views.registry import VIEWS
from derain.views.spherical_grid import ALL_AROUND
from derain.views.view import BackProjection, SeenScan, View

# The most that the Spec of a network may ask for, seven times as many as 3D-OutDet looks at. A
# hundred thousand points have 80 MB of them.
MOST_NETWORK_NEIGHBOURS = 64


@dataclass(frozen=True, eq=False)
class Neighbourhoods(SeenScan):
    """One or more scans as a point network sees them.

    The M points are the distinct valid positions of the scan, along a Morton curve. Of several rows
    at one position the network sees the first, and all of them are given its score.

    Attributes:
        points: The view's channels, each in its own unit, float32 (M, C).
        neighbours: The point itself, then its nearest neighbours in ascending distance, as rows
            of ``points``, int64 (M, k).
        distances: Their distances in metres, float32 (M, k).
        first: Row of the scan that each point was taken from, int64 (M,).
        inverse: Point whose score each row of the scan is given, int64 (N,); -1 for invalid rows.
    """

    VARYING: ClassVar[str | None] = "points"

    points: NDArray[np.float32]
    neighbours: NDArray[np.int64]
    distances: NDArray[np.float32]
    first: NDArray[np.int64]
    inverse: NDArray[np.int64]

    @property
    def size(self) -> int:
        """M, the number of points that the network scores."""
        return len(self.points)

    @property
    def judged(self) -> NDArray[np.bool_]:
        """True for rows of the scan that are given the score of some point, bool (N,)."""
        return self.inverse >= 0

    def inputs(self) -> dict[str, NDArray[Any]]:
        """The network's inputs, in its order: points, distances, neighbours."""
        return {
            "points": self.points,
            "distances": self.distances,
            "neighbours": self.neighbours,
        }

    def target(self, rain: NDArray[np.bool_]) -> NDArray[np.int64]:
        """What the network is to say of each of its points.

        Args:
            rain: Truth for every row of the scan, bool (N,).

        Returns:
            1 for rain, 0 for everything else, int64 (M,).
        """
        return rain[self.first].astype(np.int64)

    def back_projection(self) -> BackProjection:
        """What gives every row the score of its point, and invalid rows 0."""
        return partial(_to_rows, self.inverse)

    @staticmethod
    def pack(seen: Sequence["Neighbourhoods"]) -> dict[str, NDArray[Any]]:
        """Inputs of several scans as one cloud, each scan's neighbours staying its own."""
        offsets = np.cumsum([0, *(len(one.points) for one in seen)])
        return {
            "points": np.concatenate([one.points for one in seen]),
            "distances": np.concatenate([one.distances for one in seen]),
            "neighbours": np.concatenate(
                [one.neighbours + offset for one, offset in zip(seen, offsets, strict=False)]
            ),
        }


@VIEWS.add("neighbours")
@dataclass(frozen=True)
class NeighbourView(View):
    """How a scan becomes neighbourhoods; the same in training and in deployment.

    Args:
        neighbours: k, the size of a neighbourhood, the point itself included.
        channels: What the network sees of a point, in order, as :meth:`Scan.channel` names it.
        stand_in: What stands in for a value that a scan lacks, by channel; 0 if not named.
        threads: Threads of the search; 0 takes every core this process may use.
    """

    neighbours: int = 9
    channels: tuple[str, ...] = ("x", "y", "z", "intensity")
    stand_in: Mapping[str, float] = field(default_factory=dict)
    threads: int = 0

    @classmethod
    def of(
        cls, entry: Entry, channels: tuple[str, ...], stand_in: Mapping[str, float], threads: int
    ) -> Self:
        """The view that a Spec describes by its ``kind`` and its ``neighbours``.

        Raises:
            InputError: Something that does not describe it.
        """
        found = entry.record(
            {"kind": Entry.text, "neighbours": lambda e: e.whole(1, MOST_NETWORK_NEIGHBOURS)},
            required=("neighbours",),
        )
        return cls(found["neighbours"], channels, stand_in, threads)

    def as_dict(self) -> dict[str, Any]:
        """Its part of a Spec: ``kind`` and ``neighbours``."""
        return {"kind": self.NAME, "neighbours": self.neighbours}

    @property
    def azimuth(self) -> tuple[float, float]:
        """What it sees: everything around."""
        return ALL_AROUND

    def __call__(self, scan: Scan) -> Neighbourhoods:
        """Views a scan."""
        first, inverse = distinct_rows(scan)
        xyz = scan.xyz.take(first, axis=0)
        neighbours, distances = nearest_neighbours(
            xyz, self.neighbours, rank=first, threads=self.threads
        )
        values = filled_values(scan, first, self.channels, self.stand_in)
        points = np.ascontiguousarray(values.T)
        return Neighbourhoods(points, neighbours, distances, first, inverse)


def _to_rows(inverse: NDArray[np.int64], score: NDArray[np.float32]) -> NDArray[np.float32]:
    result = np.zeros(len(inverse), np.float32)
    judged = inverse >= 0
    result[judged] = score[inverse[judged]]
    return result


def nearest_neighbours(
    xyz: NDArray[np.float32],
    k: int,
    rank: NDArray[np.int64] | None = None,
    threads: int = 0,
) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """Exact k nearest neighbours of every point among points at distinct positions.

    Each row starts with the point itself and ascends in distance; of equally near neighbours the
    one of lower rank comes first. Where there are fewer than k points, the farthest found fills
    the row.

    Args:
        xyz: Coordinates of M distinct positions, float32 (M, 3), metres.
        k: Neighbours to find, the point itself included.
        rank: Order among equally near points, int64 (M,); by default their order in ``xyz``.
        threads: Threads of the search; 0 takes every core this process may use.

    Returns:
        Rows of ``xyz``, int64 (M, k), and distances in metres, float32 (M, k).
    """
    count = len(xyz)
    if not count:
        return np.zeros((0, k), np.int64), np.zeros((0, k), np.float32)
    rank = np.arange(count) if rank is None else rank
    search = _Search(xyz, threads or usable_cores())
    found = min(k, count)
    # One more than asked for shows whether the last neighbour has an equal just behind it.
    rows, squared = search(slice(None), min(k + 1, count))
    equal = squared[:, 1:] == squared[:, :-1]
    rows, squared = rows[:, :found], squared[:, :found]
    if equal.any():
        tied = np.flatnonzero(equal.any(axis=1))
        rows[tied], squared[tied] = _settle(search, tied, found, rank)
    missing = ((0, 0), (0, k - found))
    if found < k:
        rows, squared = np.pad(rows, missing, mode="edge"), np.pad(squared, missing, mode="edge")
    return np.ascontiguousarray(rows), np.sqrt(squared.astype(np.float32))


class _Search:
    """Nearest neighbours by small_gicp's kd-tree.

    It computes in float64, where equal squared distances of float32 points are ties, not rounding.
    """

    def __init__(self, xyz: NDArray[np.float32], threads: int) -> None:
        self.xyz = xyz.astype(np.float64)
        self.threads = threads
        self.tree = small_gicp.KdTree(self.xyz, num_threads=threads)

    def __call__(
        self, queries: slice | NDArray[np.int64], k: int
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        rows, squared = self.tree.batch_knn_search(self.xyz[queries], k, num_threads=self.threads)
        return rows.view(np.int64), squared


def _settle(
    search: _Search, queries: NDArray[np.int64], k: int, rank: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Searches anew for queries with equally near neighbours, which come in ascending rank."""
    rows = np.empty((len(queries), k), np.int64)
    squared = np.empty((len(queries), k))
    pending = np.arange(len(queries))
    width = k
    while len(pending):
        width = min(2 * width, len(rank))
        near_rows, near_squared = search(queries[pending], width)
        order = np.lexsort((rank[near_rows], near_squared))
        rows[pending] = np.take_along_axis(near_rows, order, axis=1)[:, :k]
        squared[pending] = near_squared[:, :k]
        # A tie across the k-th place may go on behind the last neighbour found.
        open_ended = near_squared[:, -1] == near_squared[:, k - 1]
        pending = pending[open_ended & (width < len(rank))]
    return rows, squared
