"""Points that are one return, written more than once: on one ray, as good as equally far.

Sensors with two returns, deskewed scans and merged files write most points nearly twice, fractions
of a millimetre to centimetres apart. Such copies hold no information about a neighbourhood, as
those at exactly one position hold none.
"""

import numpy as np

from derain.scan import Bools, Float32s, Ints

# Two points are one return where their ranges differ by no more than this, metres, and their
# directions by no more than this, radians. LiDARs measure ranges to 1 to 3 cm, and neighbouring
# rays are at least three times as far apart, in all but the finest sensors.
# Source: modelling choice.
RANGE_RESOLUTION = 0.05
SAME_RAY = 4e-4


def merged_points(
    xyz: Float32s, rows: Ints, neighbours: Ints, distances: Float32s
) -> tuple[Ints, Ints]:
    """Finds which points of a scan are one return.

    Each is one with the point of the lowest row among those that it is one return with.

    Args:
        xyz: Distinct positions in the sensor's frame, float32 (M, 3), metres.
        rows: Their rows in the scan, int64 (M,).
        neighbours: Of each point itself and its nearest neighbours, int64 (M, k).
        distances: Their distances, float32 (M, k), metres.

    Returns:
        Of each return the point of the lowest row, int64 (R,), in the order of the points; and the
        return that each point is, as a row of the former, int64 (M,).
    """
    one_return = are_one_return(xyz, np.arange(len(xyz)), neighbours, distances)
    own, place_of_other = np.nonzero(one_return)
    other = neighbours[own, place_of_other + 1]
    by_row = np.argsort(rows)
    place = np.empty_like(by_row)
    place[by_row] = np.arange(len(rows))
    lowest = place.copy()  # places in the order of rows, so that the least is of the lowest row
    np.minimum.at(lowest, own, place[other])
    np.minimum.at(lowest, other, place[own])
    keeper = by_row[lowest]
    while (keeper[keeper] != keeper).any():  # what a point is one with may be one with another
        keeper = keeper[keeper]
    kept = np.flatnonzero(keeper == np.arange(len(rows)))
    return kept, np.searchsorted(kept, keeper)


def are_one_return(xyz: Float32s, points: Ints, neighbours: Ints, distances: Float32s) -> Bools:
    """True for neighbours of some points that are one return with them.

    Args:
        xyz: Distinct positions in the sensor's frame, float32 (M, 3), metres.
        points: Rows of Q of them, int64 (Q,).
        neighbours: Of each of these itself and its nearest neighbours, int64 (Q, k).
        distances: Their distances, float32 (Q, k), metres.

    Returns:
        bool (Q, k - 1), of the neighbours.
    """
    same = distances[:, 1:] <= 2 * RANGE_RESOLUTION
    row, place = np.nonzero(same)
    point, other = points[row], neighbours[row, place + 1]
    apart = distances[row, place + 1].astype(np.float64)
    places = (xyz.take(rows, axis=0).astype(np.float64) for rows in (point, other))
    own, others = (np.linalg.norm(place, axis=1) for place in places)
    farther = others - own
    # The square of a chord is that of the difference of ranges, and 2 r r' (1 - cos) of the angle.
    same[row, place] = (
        (np.abs(farther) <= RANGE_RESOLUTION)
        & (apart * apart - farther * farther <= SAME_RAY * SAME_RAY * own * others)
        & (point != other)  # the farthest point found fills up where there are few
    )
    return same
