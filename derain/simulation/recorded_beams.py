"""Finds the beams behind a recorded scan, those that returned nothing included."""

import warnings
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from derain.scan import Bools, Float32s, Floats, Ints, Scan
from derain.simulation.arrays import Columns
from derain.simulation.sensor import unit_vectors
from derain.views.directions import directions
from derain.views.grid_fit import GridFit, fit_grid
from derain.views.spherical_grid import ALL_AROUND, FULL_CIRCLE

# Rounds of the median polish: enough for sensors whose lasers point to a few distinct azimuths.
ROUNDS = 3

# Row and column of an organised scan give the direction of its beams if at least half of the
# returns are no farther than this from the direction of their cell, degrees. Those of spinning
# sensors are within a tenth of it.
FARTHEST_STRAY = 1.0

# Where the inclinations of the beams are not found, a column of the grid is taken to have as many
# beams as this quantile of the columns has returns: even rows as fine as the closest of uneven
# beams are several times as many.
FULLEST_COLUMNS = 0.99


@dataclass(frozen=True, eq=False)
class RecordedBeams(Columns):
    """The beams of a recorded scan: first one for each of its N rows, then those without a row.

    Attributes:
        row: Row of the scan that stands for each beam, int64 (B,): the beam's own row; for a beam
            without a return, the row of the return before it in the same row of the sensor's grid.
        direction: Unit vectors, float64 (B, 3), sensor frame; not a number where it is not known.
        returned: True for the beams that returned, bool (B,).
    """

    row: Ints
    direction: Floats
    returned: Bools


def find_beams(scan: Scan, generator: Generator) -> RecordedBeams:
    """Finds the beams of a scan.

    Every return is a beam of its own, along its own direction, even if several returns lie in one
    cell of a grid. Beams that returned nothing are found in one of two ways:

    - An organised scan has a cell for each beam. The direction of an empty cell is the sum of the
      usual angles of its row and of its column. It is not known in a row or column without any
      return, nor in a scan with returns far from the directions found in this way, such as a scan
      in a rosette.
    - To any other scan a grid is fitted, see :func:`derain.views.grid_fit.fit_grid`. Its empty
      pixels are beams that returned nothing, with an exception: a return that shares its pixel with
      another has left a pixel of its own empty. The same number of empty pixels, chosen at random,
      are therefore no beams. Where the inclinations of the beams are not found, a column has no
      more beams than the fullest columns have returns. A sensor that looks one way, with returns in
      no rows, may have a round field of view: only its pixels in the convex hull of the returns are
      beams.

    Args:
        scan: The scan. Rows that are not valid, or of a radar, are empty cells or no beams.
        generator: Random generator.

    Source: REHEARSE-3D, Algorithm 1, for the purpose; the method is another.
    """
    valid = scan.valid if scan.radar is None else scan.valid & ~scan.radar
    own = np.full((len(scan), 3), np.nan)
    xyz = scan.xyz[valid].astype(np.float64)
    own[valid] = xyz / np.linalg.norm(xyz, axis=1, keepdims=True)
    rows = np.arange(len(scan))
    if scan.shape is not None:
        usual = _cell_directions(scan, valid)
        stray = np.linalg.norm(usual - own, axis=1)[valid]
        if len(stray) and np.median(stray) > np.radians(FARTHEST_STRAY):
            usual = np.full_like(usual, np.nan)
        return RecordedBeams(rows, np.where(valid[:, None], own, usual), valid)
    recorded = RecordedBeams(rows, own, valid)
    if not valid.any():
        return recorded
    return RecordedBeams.joined([recorded, _unreturned(scan, valid, generator)])


def _cell_directions(scan: Scan, valid: Bools) -> Floats:
    """Usual direction of every cell of an organised scan, float64 (N, 3)."""
    assert scan.shape is not None
    angles = np.full((2, len(scan)), np.nan)
    angles[:, valid] = directions(scan.xyz[valid])
    azimuth, inclination = angles.reshape(2, *scan.shape)
    # Cells of a column look much the same way: nearer than half a turn to the first that returned.
    first = np.argmax(np.isfinite(azimuth), axis=0)
    reference = azimuth[first, np.arange(azimuth.shape[1])]
    azimuth = reference + (azimuth - reference + 180) % 360 - 180
    return unit_vectors(_polished(azimuth).ravel(), _polished(inclination.T).T.ravel())


def _polished(angle: Floats) -> Floats:
    """Sum of a column's and a row's effect in every cell, of (H, W) angles or NaN.

    The effect of the columns is estimated first, and should be the larger one: otherwise rows that
    lack different columns would seem to differ.

    Source: Tukey 1977, "Exploratory Data Analysis", the median polish.
    """
    of_row = np.zeros((angle.shape[0], 1))
    of_column = np.zeros((1, angle.shape[1]))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # an empty row or column has the median NaN
        for _ in range(ROUNDS):
            of_column = np.nanmedian(angle - of_row, axis=0, keepdims=True)
            of_row = np.nanmedian(angle - of_column, axis=1, keepdims=True)
    return of_row + of_column


def _unreturned(scan: Scan, valid: Bools, generator: Generator) -> RecordedBeams:
    """The beams that returned nothing, found as empty pixels of a grid."""
    seen = np.flatnonzero(valid)
    fit = fit_grid([scan.take(seen)])
    pixels = fit.grid.rows * fit.grid.columns
    pixel = fit.grid.pixel(scan.xyz[seen])
    empty = np.setdiff1d(np.arange(pixels), pixel)
    doubled = len(seen) - (pixels - len(empty))
    if not fit.beams and fit.grid.azimuth != ALL_AROUND:
        empty = empty[_looked_at(fit, scan.xyz[seen[pixel >= 0]], empty)]
    count = len(empty) - doubled
    if not fit.beams:
        returns = np.bincount(pixel[pixel >= 0] % fit.grid.columns, minlength=fit.grid.columns)
        most = np.quantile(returns, FULLEST_COLUMNS) * fit.grid.columns
        count = min(count, int(most) - len(seen))
    count = max(count, 0)
    chosen = np.sort(generator.choice(empty, count, replace=False))
    by_pixel = np.argsort(pixel, kind="stable")
    before = np.searchsorted(pixel[by_pixel], chosen) - 1
    row = seen[by_pixel[np.maximum(before, 0)]]
    return RecordedBeams(row, unit_vectors(*_pixel_angles(fit, chosen)), np.zeros(len(row), bool))


def _looked_at(fit: GridFit, xyz: Float32s, pixel: Ints) -> Bools:
    """True if pixels lie in the convex hull of the returns, bool (P,)."""
    azimuth, inclination = directions(xyz)
    across, up = _pixel_angles(fit, pixel)
    right = fit.grid.azimuth[0]  # from where azimuths rise without a jump
    from_right = (azimuth - right) % FULL_CIRCLE
    return in_hull((from_right, inclination), (across - right, up))


def _pixel_angles(fit: GridFit, pixel: Ints) -> tuple[Floats, Floats]:
    """Azimuth and inclination of the beam of each pixel, or of its middle, float64 (P,) each."""
    row, column = np.divmod(pixel, fit.grid.columns)
    edges = np.array(fit.grid.edges)
    inclination = np.array(fit.beams) if fit.beams else (edges[:-1] + edges[1:]) / 2
    right, left = fit.grid.azimuth
    azimuth = left - (column + 0.5) * (left - right) / fit.grid.columns
    return azimuth, inclination[row]


def in_hull(points: tuple[Floats, Floats], places: tuple[Floats, Floats]) -> Bools:
    """True if places lie in the convex hull of points, or on its edge.

    The hull of the returns never reaches beyond a field of view that is convex, be it a rectangle
    or a circle. It falls short of it where nothing returned near the edge, for example from the
    sky.

    Args:
        points: Azimuth and inclination of the returns, float64 (N,) each, N > 0, degrees, the
            azimuth without a jump inside the field of view.
        places: Azimuth and inclination of the places, float64 (M,) each, likewise.

    Returns:
        True for the places inside, bool (M,).
    """
    (azimuth, inclination), (across, up) = points, places
    inside: Bools = (across >= azimuth.min()) & (across <= azimuth.max())
    inside &= up <= np.interp(across, *_upper_hull(azimuth, inclination))
    inside &= -up <= np.interp(across, *_upper_hull(azimuth, -inclination))
    return inside


def _upper_hull(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Corners of the upper side of the convex hull, from left to right."""
    order = np.lexsort((y, x))
    x, y = x[order], y[order]
    highest = np.append(x[1:] > x[:-1], True)  # of the points at one x only the highest
    x, y = x[highest], y[highest]
    while True:
        run, rise = np.diff(x), np.diff(y)
        # A point on or below the line between its two neighbours is no corner of the hull. That
        # stays true when a neighbour is dropped in the same round, for the hull lies higher still.
        corner = np.ones(len(x), bool)
        corner[1:-1] = rise[1:] * run[:-1] < rise[:-1] * run[1:]
        if corner.all():
            return x, y
        x, y = x[corner], y[corner]
