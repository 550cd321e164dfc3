"""Pixels of a spherical grid by look-up, without trigonometry; every answer is exact.

A direction has two coordinates, each computed with one division: its *height*, which ascends with
the inclination, and its *turn*, which ascends with the azimuth. Both are divided into many more
bins than a grid has rows or columns, and a table holds the row or column of each bin. Bins that
contain a border are unsure, and so are bins so near to one that rounding may choose the wrong bin.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from derain.scan import Array, Float32s, Floats, Ints

# Bins of each table. A grid of 2048 columns leaves 32 of them to a column, one of which is unsure.
BINS = 2**16

# Bins nearer than this to a border are unsure, in bins. Height and turn are computed in float32,
# from coordinates that may have been rounded to it: that moves them by less than 4 units of 2⁻²⁴
# of their whole extent, which is 1/64 of a bin.
BORDER_MARGIN = 1 / 16

# Entries of a table that are not pixels. Entries of both tables are added: the sum is below
# UNSURE_BELOW if one is unsure; otherwise it is negative if one is outside the grid.
OUTSIDE = -(2**24)
UNSURE_BELOW = 2 * OUTSIDE
UNSURE = 2 * UNSURE_BELOW

# Squared ranges, in square metres, of points whose height float32 holds to that precision.
SQUARED_RANGES = (1e-20, 1e20)

# Points that are looked up at a time, so that intermediate results stay in the cache.
POINTS_AT_A_TIME = 2**14

# Maps angles, float64 (M,), degrees, to rows or columns of a grid, int64 (M,).
OfAngles = Callable[[Floats], Ints]


class DirectionTable:
    """The pixel of a grid that each direction falls into.

    Args:
        inclinations: Borders between rows, and the grid's bounds, float64, degrees.
        first_pixel: First pixel of an inclination's row; OUTSIDE if there is none.
        azimuths: Borders between columns, and the grid's bounds, float64, degrees.
        column: Column of an azimuth; OUTSIDE if there is none.
    """

    def __init__(
        self, inclinations: Floats, first_pixel: OfAngles, azimuths: Floats, column: OfAngles
    ) -> None:
        middles = np.arange(BINS) + 0.5
        inclinations, azimuths = np.radians(inclinations), np.radians(azimuths)
        heights = height_of(np.sin(inclinations), 1.0)
        turns = turn_of(np.cos(azimuths), np.sin(azimuths))
        self._first_pixels = _table(first_pixel(_inclination(middles)), heights)
        self._columns = _table(column(_azimuth(middles)), turns)

    def __call__(self, xyz: Float32s) -> Ints:
        """Looks up points.

        Args:
            xyz: Finite coordinates, float32 (N, 3), metres in the sensor frame.

        Returns:
            Pixels, int64 (N,); negative outside the grid, and less than UNSURE_BELOW where the
            table is unsure.
        """
        pixel = np.empty(len(xyz), np.int64)
        for start in range(0, len(xyz), POINTS_AT_A_TIME):
            part = slice(start, start + POINTS_AT_A_TIME)
            pixel[part] = self._look_up(xyz[part])
        return pixel

    def _look_up(self, xyz: Float32s) -> NDArray[np.int32]:
        # An overflow or a division by zero ends up unsure.
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
            x, y, z = np.ascontiguousarray(xyz.T, dtype=np.float32)
            squared = x * x + y * y + z * z
            height = height_of(z, np.sqrt(squared)).astype(np.int64)
            turn = turn_of(x, y).astype(np.int64)
        # Clipping bounds NaN; all other values are within.
        pixel = self._first_pixels.take(height, mode="clip") + self._columns.take(turn, mode="clip")
        least, most = SQUARED_RANGES
        pixel[~((squared > least) & (squared < most))] = UNSURE
        return pixel


def _table(of_bins: Ints, borders: Floats) -> NDArray[np.int32]:
    """The entry of each bin, int32 (BINS + 1,): the last is for the value BINS itself."""
    table = np.append(of_bins, UNSURE).astype(np.int32)
    for near in (borders - BORDER_MARGIN, borders + BORDER_MARGIN):
        table[np.clip(near, 0, BINS).astype(np.int64)] = UNSURE
    # Both ends of the turns are straight behind; at both of the heights is a pole, without a turn.
    table[[0, BINS - 1]] = UNSURE
    return table


def height_of(z: Array, distance: Array | float) -> Array:
    """The sine of the inclination, in bins from 0 to BINS."""
    return (z / distance + 1) * (BINS // 2)


def _inclination(height: Array) -> Floats:
    """Inclination of a height, degrees."""
    return np.degrees(np.arcsin(height / (BINS // 2) - 1))


def turn_of(x: Array, y: Array) -> Array:
    """The distance from straight behind, counter-clockwise, in bins from 0 to BINS.

    It is measured along the square |x| + |y| = 1, each of whose sides replaces an arc.
    """
    distance: Array = 2 + np.copysign(1 - x / (np.abs(x) + np.abs(y)), y)
    return distance * (BINS // 4)


def _azimuth(turn: Array) -> Floats:
    """Azimuth of a turn, degrees."""
    distance = turn / (BINS // 4) - 2
    x = 1 - np.abs(distance)
    return np.asarray(np.degrees(np.arctan2(np.copysign(1 - np.abs(x), distance), x)))
