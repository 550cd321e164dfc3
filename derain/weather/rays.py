"""Where each ray of a scan ends, and whether at rain.

Returns in one direction are of one ray: the copies of a return that dual-return sensors write, and
what stands behind a drop. They are told by direction alone, in one sort, for that takes a small
part of the time of :func:`derain.views.returns.pair_returns`, which says which return is which.
"""

import numpy as np
from numpy.typing import NDArray

from derain.scan import Scan

# Sectors of azimuth, each of 30 degrees like the hours of a clock: the first has x (ahead) in its
# middle, the next ones follow towards y (left).
RAY_SECTORS = 12

# Bins of range: so many metres each, and one more for whatever is beyond them, 80 m and more.
BIN = 0.5
RANGE_BINS = 161

# Returns are of one ray whose directions lie in one cell of so many cells a degree. Two rays that
# are neighbours are farther apart: 0.1 degrees and more. Coordinates are rounded to float32, which
# is far finer, or to millimetres, which near by is coarser: such returns count as rays of their
# own.
CELLS_PER_DEGREE = 100
CELLS_PER_RADIAN = np.float32(CELLS_PER_DEGREE * 180 / np.pi)
AROUND, UPWARDS = 360 * CELLS_PER_DEGREE, 180 * CELLS_PER_DEGREE

# A ray as one number, from the top: inclination and azimuth of its cell, then what a return of it
# is and where it lies, so that sorting brings the returns of a ray together, rain first.
BITS_OF_BIN, BITS_OF_AZIMUTH = 8, 16
NOT_RAIN = 1 << BITS_OF_BIN
BITS_OF_RETURN = BITS_OF_BIN + 1


def ray_ends(scan: Scan, rain: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Counts the rays of a scan by where they end.

    A ray that met rain ends at the nearest return of it that is rain, even where something else was
    seen behind; any other ends at its farthest return.

    Args:
        scan: The scan, N points in the frame of its sensor. Points that cannot be judged and those
            of a radar are of no ray.
        rain: True for rain, bool (N,).

    Returns:
        Numbers of rays, int64 (2, RAY_SECTORS, RANGE_BINS): those that end at something
        else, and those that end at rain.
    """
    asked = scan.valid if scan.radar is None else scan.valid & ~scan.radar
    every = bool(asked.all())
    xyz, reach = (scan.xyz, scan.range) if every else (scan.xyz[asked], scan.range[asked])
    returns = _numbered(xyz, reach, rain if every else rain[asked])
    # A stable sort, since it makes use of what is in order already, as the rows of most files are.
    return _counted(_ends_of(np.sort(returns, kind="stable")))


def _numbered(
    xyz: NDArray[np.float32], reach: NDArray[np.float32], rain: NDArray[np.bool_]
) -> NDArray[np.int64]:
    """Each return as one number, int64 (M,)."""
    x, y, z = np.ascontiguousarray(xyz.T) + np.float32(0)  # -0.0 would be another way than 0.0
    azimuth = _cells(np.arctan2(y, x)) % AROUND
    inclination = _cells(np.arctan2(z, np.sqrt(x * x + y * y))) + UPWARDS // 2
    # Not above the last bin, however far.
    place = np.minimum(reach / np.float32(BIN), np.float32(RANGE_BINS - 1)).astype(np.int64)
    direction = inclination << BITS_OF_AZIMUTH | azimuth
    what = np.where(rain, 0, NOT_RAIN)
    numbers: NDArray[np.int64] = direction << BITS_OF_RETURN | what | place
    return numbers


def _cells(angle: NDArray[np.float32]) -> NDArray[np.int64]:
    """Numbers of the cells that angles lie in, from radians, int64 (M,)."""
    cells: NDArray[np.int64] = np.floor(angle * CELLS_PER_RADIAN).astype(np.int64)
    return cells


def _ends_of(returns: NDArray[np.int64]) -> NDArray[np.int64]:
    """Of the sorted returns, the one of each ray at which it ends, int64 (rays,)."""
    if not len(returns):
        return returns
    direction = returns >> BITS_OF_RETURN
    changes = np.flatnonzero(direction[1:] != direction[:-1])
    first = returns[np.concatenate([[0], changes + 1])]
    last = returns[np.concatenate([changes, [len(returns) - 1]])]
    ends: NDArray[np.int64] = np.where(first & NOT_RAIN, last, first)
    return ends


def _counted(ends: NDArray[np.int64]) -> NDArray[np.int64]:
    """Numbers of rays by what they end at, sector and bin, int64 (2, RAY_SECTORS, RANGE_BINS)."""
    azimuth = ends >> BITS_OF_RETURN & ((1 << BITS_OF_AZIMUTH) - 1)
    wide = AROUND // RAY_SECTORS
    sector = (azimuth + wide // 2) % AROUND // wide
    at_rain = (ends & NOT_RAIN) == 0
    cell = (at_rain * RAY_SECTORS + sector) * RANGE_BINS + (ends & (NOT_RAIN - 1))
    counts = np.bincount(cell, minlength=2 * RAY_SECTORS * RANGE_BINS)
    return counts.reshape(2, RAY_SECTORS, RANGE_BINS).astype(np.int64)
