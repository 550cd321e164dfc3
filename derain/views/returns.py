"""Dual returns: which points are of one ray, and which of them is the nearer one.

What stands behind the nearer return of a ray is proof that the ray went through it: drops are such,
edges and twigs are, and walls are not. On raw WADS scans the nearer of two returns is snow in 32 to
42 of 100, the farther in 1 to 2 (``benchmarks/dual_returns.py``).
"""

from dataclasses import dataclass, replace
from typing import Self
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from derain.scan import Scan
from derain.views.directions import shared_direction_pairs
from derain.views.morton import distinct_rows
from derain.views.return_columns import LEAST_APART, StatedReturns, stated_returns

# By what returns are told where no column says.
BY_DIRECTIONS = "directions"


@dataclass(frozen=True, eq=False)
class RayReturns:
    """The return that each row of a scan is of its ray.

    A row that cannot be judged, one of the radar, and the only return of a ray are neither nearer
    nor farther. Rows at one position are one return that was written more than once, as dual-return
    sensors write a ray that met one thing; each of them is told the same.

    Attributes:
        nearer: Another return of the row's ray lies behind it, bool (N,): the ray went through.
        farther: Another one lies in front of it, bool (N,).
        partner: Row of the return next behind it, of the farthest that next in front, int64 (N,);
            -1 where there is none, or where it is no row of the scan.
        partner_range: Range of that return, whether or not it is a row, float32 (N,), metres; NaN
            where there is none or nobody knows.
        found_by: Name of the column that says so, ``directions``, or empty where nothing shows that
            any ray has two returns.
    """

    nearer: NDArray[np.bool_]
    farther: NDArray[np.bool_]
    partner: NDArray[np.int64]
    partner_range: NDArray[np.float32]
    found_by: str

    @classmethod
    def single(cls, points: int) -> Self:
        """Those of a scan each of whose rays has one."""
        none = np.zeros(points, bool)
        nowhere = np.full(points, np.nan, np.float32)
        return cls(none, none.copy(), np.full(points, -1), nowhere, "")

    @property
    def dual(self) -> bool:
        """True if any ray is known to have two returns."""
        return bool(self.found_by)


def pair_returns(scan: Scan) -> RayReturns:
    """Finds which returns of a scan are of one ray.

    Where columns of the file say which return a row is (:func:`stated_returns`), they count; the
    rows of a ray are found by their direction all the same. Where none says so, directions alone
    have to, if more of them agree than could by chance. Of two returns, the nearer is that of the
    smaller range, and a column that contradicts most of these pairs is taken the other way round,
    as some drivers write it. Nearer than LEAST_APART to each other, two returns are one.

    A scan asked for again is answered at once.

    Args:
        scan: The scan, in the frame of its sensor: seen from elsewhere, no two returns agree.

    Returns:
        What each row is, whatever the order of the rows.
    """
    if scan not in _KNOWN:
        _KNOWN[scan] = _pair(scan)
    return _KNOWN[scan]


# What was found of scans that are still there: a view, its warnings and a method ask in turn.
_KNOWN: WeakKeyDictionary[Scan, RayReturns] = WeakKeyDictionary()


def _pair(scan: Scan) -> RayReturns:
    stated = stated_returns(scan)
    first, inverse = distinct_rows(scan)
    ranges = scan.range[first]
    may = ranges > 0
    if scan.radar is not None:
        may &= ~scan.radar[first]
    if stated is not None:
        may &= stated.number[first] >= 0
    asked = np.flatnonzero(may)
    pairs = asked[
        shared_direction_pairs(scan.xyz.take(first[asked], axis=0), evident=stated is None)
    ]
    near, far = np.where(ranges[pairs[:, 0]] <= ranges[pairs[:, 1]], pairs.T, pairs.T[::-1])
    apart = ranges[far] - ranges[near] >= LEAST_APART
    if stated is not None:
        outwards = stated.number[first[far]] - stated.number[first[near]]
        apart &= outwards != 0
        if (outwards[apart] < 0).sum() > (outwards[apart] > 0).sum():
            stated = replace(stated, nearer=stated.farther, farther=stated.nearer)
    found = _of_pairs(near[apart], far[apart], ranges)
    if not found.dual and stated is None:
        return RayReturns.single(len(scan))
    return _to_rows(found, first, inverse, stated)


def _of_pairs(
    near: NDArray[np.int64], far: NDArray[np.int64], ranges: NDArray[np.float32]
) -> RayReturns:
    """The return number of points, from their pairs.

    Args:
        near: The nearer point of each pair, int64 (P,).
        far: The farther one, int64 (P,).
        ranges: Range of each point, float32 (M,), metres.
    """
    nearer, farther = np.zeros((2, len(ranges)), bool)
    nearer[near], farther[far] = True, True
    partner = np.full(len(ranges), -1)
    # The last that is written stays: in front the farthest, and rather than that, behind the
    # nearest.
    in_front = np.argsort(ranges[near], kind="stable")
    partner[far[in_front]] = near[in_front]
    behind = np.argsort(-ranges[far], kind="stable")
    partner[near[behind]] = far[behind]
    partner_range = np.where(partner >= 0, ranges[partner], np.float32(np.nan))
    return RayReturns(nearer, farther, partner, partner_range, BY_DIRECTIONS if len(near) else "")


def _to_rows(
    found: RayReturns,
    first: NDArray[np.int64],
    inverse: NDArray[np.int64],
    stated: StatedReturns | None,
) -> RayReturns:
    """The return number of rows, from that of distinct positions and the stated returns.

    Args:
        found: Of M positions.
        first: The first row at each, int64 (M,).
        inverse: Position of each row, int64 (N,); -1 for rows that cannot be judged.
        stated: What the columns say; of a row without a partner it is all that is known.
    """
    # The last value is what position -1 has.
    nearer, farther = (
        np.append(values, False)[inverse] for values in (found.nearer, found.farther)
    )
    partner_of_first = np.where(found.partner >= 0, first[found.partner], -1)
    partner = np.append(partner_of_first, -1)[inverse]
    partner_range = np.append(found.partner_range, np.float32(np.nan))[inverse]
    if stated is None:
        return RayReturns(nearer, farther, partner, partner_range, BY_DIRECTIONS)
    alone = partner < 0
    nearer |= alone & stated.nearer
    farther |= alone & stated.farther
    partner_range = np.where(alone, stated.other_range, partner_range)
    return RayReturns(nearer, farther, partner, partner_range, stated.column)
