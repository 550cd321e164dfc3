"""The end of each ray of a scan, and whether it is rain.

Returns in one direction are of one ray: the copies of a return that dual-return sensors write, and
what stands behind a drop.
"""

import numpy as np
from numpy.typing import NDArray

from derain.scan import Bools, Float32s, Ints, Scan

# Sectors of azimuth, each of 30 degrees like the hours of a clock: the first has x (ahead) in its
# middle, the next ones follow towards y (left).
RAY_SECTORS = 12

# Width of a bin of range, metres, and the number of bins. The last is for everything from 300 m on,
# which few sensors reach.
BIN = 0.5
RANGE_BINS = 601

# Returns whose directions lie in one cell are of one ray. There are this many cells in a quarter of
# a turn, and as many from the horizon upwards: .003 to .006 degrees wide. Neighbouring rays are
# farther apart: 0.1 degrees and more. Coordinates are rounded to float32, which is far finer, or to
# millimetres, which near by is coarser: such returns count as rays of their own.
CELLS_IN_QUARTER = 18_000
CELLS_UPWARDS = 11_460
CELLS_AROUND = 4 * CELLS_IN_QUARTER

# Added to what is divided by, so that it is never 0.
TINY = np.finfo(np.float32).tiny

# A return as one number: its sector, then a score of which the highest of a ray is the return at
# which that ray ends. The score of what is not rain is its bin; that of rain is above all of these,
# and the higher the nearer it is.
SCORES_IN_SECTOR = 2048

# Bits that such a number takes.
BITS_OF_END = (RAY_SECTORS * SCORES_IN_SECTOR).bit_length()


def ray_ends(scan: Scan, rain: Bools) -> Ints:
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
    xyz = scan.xyz
    of_rays = scan.valid if scan.radar is None else scan.valid & ~scan.radar
    if not of_rays.all():
        xyz, rain = xyz[of_rays], rain[of_rays]
    x, y, z = np.ascontiguousarray(xyz.T)
    reach = np.sqrt(x * x + y * y + z * z)  # which need not be as exact as Scan.range
    azimuth = _azimuth_cells(x, y)
    cell = _inclination_cells(z, reach) * np.uint32(CELLS_AROUND) + azimuth
    ends = _scores(reach, rain)
    # The returns of a ray share its sector, so that the highest number is that of the best score.
    ends += SECTOR_OF_CELL.take(azimuth)
    returns = np.sort(cell.astype(np.int64) << BITS_OF_END | ends)
    last_of_ray = np.diff(returns >> BITS_OF_END, append=-1) != 0
    return _counted(returns[last_of_ray] & ((1 << BITS_OF_END) - 1))


def _azimuth_cells(x: Float32s, y: Float32s) -> NDArray[np.uint32]:
    """Numbers of the cells of azimuth that directions lie in, uint32 (M,).

    They are alike not in degrees but in y / (|x| + |y|), which takes no trigonometry: it goes
    around the circle straight from corner to corner of a square in it.
    """
    # Straight up, any azimuth will do.
    quarters = y / (np.abs(x) + np.abs(y) + TINY)  # -1 right, 0 ahead, 1 left
    quarters = np.where(x < 0, 2 - quarters, quarters)  # 2 behind, up to 3 right again
    cells = ((quarters + 1) * CELLS_IN_QUARTER).astype(np.uint32)
    cells[cells == CELLS_AROUND] = 0
    return cells


def _inclination_cells(z: Float32s, reach: Float32s) -> NDArray[np.uint32]:
    """Numbers of the cells of inclination, alike in z / range, uint32 (M,)."""
    upwards = np.clip(z / (reach + TINY), -1, 1)  # nearer than 10⁻¹⁹ m the range becomes 0
    return ((upwards + 1) * CELLS_UPWARDS).astype(np.uint32)


def _sectors_of_cells() -> NDArray[np.int32]:
    """The sector in which the middle of each cell of azimuth lies, times SCORES_IN_SECTOR."""
    quarters = (np.arange(CELLS_AROUND) + 0.5) / CELLS_IN_QUARTER - 1
    ahead = quarters < 1
    y = np.where(ahead, quarters, 2 - quarters)
    x = np.where(ahead, 1, -1) * (1 - np.abs(y))
    width = 2 * np.pi / RAY_SECTORS
    sector: NDArray[np.int32] = np.round(np.arctan2(y, x) / width).astype(np.int32) % RAY_SECTORS
    return sector * SCORES_IN_SECTOR


SECTOR_OF_CELL = _sectors_of_cells()


def _scores(reach: Float32s, rain: Bools) -> NDArray[np.int32]:
    """Priority of returns among those of their ray, int32 (M,): rain first, the nearest of it."""
    place = np.minimum(reach / BIN, RANGE_BINS - 1)  # not above the last bin, however far
    scores: NDArray[np.int32] = place.astype(np.int32)
    return np.where(rain, SCORES_IN_SECTOR - 1 - scores, scores)


def _counted(ends: Ints) -> Ints:
    """Numbers of rays by what they end at, sector and bin, int64 (2, RAY_SECTORS, RANGE_BINS)."""
    counts = np.bincount(ends, minlength=RAY_SECTORS * SCORES_IN_SECTOR)
    counts = counts.reshape(RAY_SECTORS, SCORES_IN_SECTOR)
    rain = counts[:, ::-1]
    return np.stack([counts[:, :RANGE_BINS], rain[:, :RANGE_BINS]]).astype(np.int64)
