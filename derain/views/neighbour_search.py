"""Exact search for the nearest neighbours of points at distinct positions."""

import numpy as np

from derain.scan import Float32s, Floats, Ints
from derain.system.cores import sleeping_threads, threads_of

with sleeping_threads():
    import small_gicp

# Rows of points, and squared distances to them in square metres.
Found = tuple[Ints, Floats]


class NeighbourSearch:
    """Finds nearest neighbours by small_gicp's kd-tree, equally near ones in a known order.

    The tree computes in float64, where equal squared distances of float32 points are ties, not
    rounding. So the answer does not depend on the order that the points are in.

    Args:
        xyz: Coordinates of M distinct positions, float32 (M, 3), metres.
        rank: Order among equally near points, int64 (M,); by default their order in ``xyz``.
        threads: Threads of the search; 0 takes every core this process may use.
    """

    def __init__(self, xyz: Float32s, rank: Ints | None = None, threads: int = 0) -> None:
        self._xyz = xyz.astype(np.float64)
        self._rank = np.arange(len(xyz)) if rank is None else rank
        self._threads = threads_of(threads)
        self._tree = small_gicp.KdTree(self._xyz, num_threads=self._threads) if len(xyz) else None

    def __call__(self, k: int, queries: Ints | None = None) -> tuple[Ints, Float32s]:
        """Finds the k nearest neighbours of some of the points.

        Each row starts with the point itself and ascends in distance; of equally near neighbours
        the one of lower rank comes first. Where there are fewer than k points, the farthest found
        fills the row.

        Args:
            k: Neighbours to find, the point itself included.
            queries: Rows of the points whose neighbours are sought, int64 (Q,); None for all.

        Returns:
            Rows of ``xyz``, int64 (Q, k), and distances in metres, float32 (Q, k).
        """
        count = len(self._xyz) if queries is None else len(queries)
        if not count:
            return np.zeros((0, k), np.int64), np.zeros((0, k), np.float32)
        found = min(k, len(self._xyz))
        # One more than needed shows whether the last neighbour has an equal just behind it.
        rows, squared = self.nearest(queries, min(k + 1, len(self._xyz)))
        tied = _rows_with_equals(squared)
        if len(tied):
            of_tied = tied if queries is None else queries[tied]
            settled = self._in_order((rows[tied], squared[tied]), of_tied, found)
            rows[tied, :found], squared[tied, :found] = settled
        rows, squared = np.ascontiguousarray(rows[:, :found]), squared[:, :found]
        if found < k:
            missing = ((0, 0), (0, k - found))
            rows = np.pad(rows, missing, mode="edge")
            squared = np.pad(squared, missing, mode="edge")
        return rows, np.sqrt(squared.astype(np.float32))

    def nearest(self, queries: Ints | None, k: int) -> Found:
        """Finds nearest neighbours, equally near ones in whatever order.

        Args:
            queries: Rows of points, int64 (Q,); None for all. There must be some.
            k: Neighbours to find, the point itself included; no more than there are points.

        Returns:
            Rows of ``xyz``, int64 (Q, k), and squared distances in square metres, float64 (Q, k),
            ascending.
        """
        assert self._tree is not None  # without points there are no queries
        # take is four times faster than indexing for rows of three numbers.
        places = self._xyz if queries is None else self._xyz.take(queries, axis=0)
        rows, squared = self._tree.batch_knn_search(places, k, num_threads=self._threads)
        return rows.view(np.int64), squared

    def _in_order(self, near: Found, queries: Ints, k: int) -> Found:
        """Puts equally near neighbours in ascending rank.

        A tie across the k-th place may go on behind the last neighbour found: there, more of them
        are sought.

        Args:
            near: What was found of each query, at least k neighbours.
            queries: Rows of the points, int64 (T,).
            k: Neighbours to keep.
        """
        rows = np.empty((len(queries), k), np.int64)
        squared = np.empty((len(queries), k))
        pending = np.arange(len(queries))
        while True:
            near_rows, near_squared = near
            order = np.lexsort((self._rank[near_rows], near_squared))
            rows[pending] = np.take_along_axis(near_rows, order, axis=1)[:, :k]
            squared[pending] = near_squared[:, :k]
            width = near_rows.shape[1]
            open_ended = near_squared[:, -1] == near_squared[:, k - 1]
            pending = pending[open_ended & (width < len(self._xyz))]
            if not len(pending):
                return rows, squared
            near = self.nearest(queries[pending], min(2 * width, len(self._xyz)))


def _rows_with_equals(ascending: Floats) -> Ints:
    """Numbers of the rows in which a value is equal to the one before it, int64.

    Args:
        ascending: Squared distances of different points, of which the first in each row is 0 and
            no other, float64 (Q, k).
    """
    # From the last of a row to the first of the next is never equal either, unless it is the same;
    # so all rows are compared as one, which is six times faster.
    width = ascending.shape[1]
    if width < 2:
        return np.zeros(0, np.int64)
    flat = ascending.ravel()
    return np.unique(np.flatnonzero(flat[1:] == flat[:-1]) // width)
