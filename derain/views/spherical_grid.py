"""A spherical grid: the rows and columns of directions that a range image is made of."""

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np

from derain.errors import InputError
from derain.files.documents import Entry, shown
from derain.scan import Float32s, Floats, Ints
from derain.views.direction_table import OUTSIDE, UNSURE_BELOW, DirectionTable
from derain.views.directions import directions

# First and last angle of a part of a circle, degrees.
Extent = tuple[float, float]

FULL_CIRCLE = 360.0
ALL_AROUND = (-180.0, 180.0)

# 512 beams by 8192 steps: more than any sensor has, and an image of 84 MB.
MOST_PIXELS = 2**22

# Inclinations of WADS's 64 beams, degrees. LiSnowNet's own table is in its repository, which derain
# does not draw on. Source: measured here, on the ten raw scans of sequence 36, by
# `python benchmarks/back_projection.py --beams WADS/sequences/36/velodyne/*.bin`; the published
# sample scan gives the same, and the returns of a beam differ by no more than 0.00001 degrees.
WADS_BEAMS = [
    *(14.842, 10.992, 8.019, 5.017, 3.0, 1.988, 1.82, 1.648, 1.482, 1.311, 1.144, 0.973, 0.806),
    *(0.635, 0.468, 0.297, 0.129, -0.04, -0.209, -0.377, -0.548, -0.715, -0.885, -1.053, -1.224),
    *(-1.391, -1.562, -1.728, -1.9, -2.068, -2.238, -2.405, -2.576, -2.74, -2.913, -3.08, -3.25),
    *(-3.415, -3.588, -3.752, -3.924, -4.09, -4.261, -4.425, -4.598, -4.76, -4.932, -5.097),
    *(-5.269, -5.431, -5.605, -5.766, -5.938, -6.101, -7.103, -8.099, -9.1, -10.085, -11.072),
    *(-12.046, -13.014, -13.97, -18.929, -24.937),
]

# Grids that published networks and data sets use, described as a user describes one.
PUBLISHED_GRIDS: Mapping[str, Mapping[str, Any]] = {
    # Source: Cortinhal et al. 2020, SalsaNext; its data_cfg and arch_cfg for SemanticKITTI.
    "semantickitti": {"rows": 64, "columns": 2048, "inclination": [-25.0, 3.0]},
    # Source: SalsaNext as run for REHEARSE-3D, arch_cfg.yaml (sporsho/sporsho.github.io).
    "rehearse3d": {"rows": 64, "columns": 2048, "inclination": [-20.0, 15.0]},
    # Source: Yu et al. 2022, LiSnowNet: one row a beam, 2048 columns.
    "wads": {"beams": WADS_BEAMS, "columns": 2048},
}


@dataclass(frozen=True)
class SphericalGrid:
    """Rows of inclination by columns of azimuth.

    A pixel holds its upper and its left border; the lowest row also holds the lower bound. On a
    full circle the last column is the neighbour of the first; elsewhere it also holds the right
    bound.

    Attributes:
        columns: W, the number of columns, of equal width, column 0 at the left.
        azimuth: Right and left bound, degrees counter-clockwise from x; the left one may pass 180
            where the grid looks backward.
        edges: Borders of the H rows from top to bottom, H + 1 inclinations, degrees.

    Raises:
        InputError: Bounds that leave no room, or that no direction can have; more than MOST_PIXELS.
    """

    columns: int
    azimuth: Extent
    edges: tuple[float, ...]

    def __post_init__(self) -> None:
        right, left = self.azimuth
        size = f"{self.rows} rows by {self.columns} columns"
        if min(self.rows, self.columns) < 1 or self.rows * self.columns > MOST_PIXELS:
            raise _wrong(size, f"Give at least one of each, and at most {MOST_PIXELS:,} pixels.")
        if not (-FULL_CIRCLE <= right < left <= right + FULL_CIRCLE):
            reason = f"azimuth from {right:g} to {left:g} degrees"
            raise _wrong(reason, "Give the right bound, then the left, at most 360 degrees apart.")
        descending = all(above > below for above, below in itertools.pairwise(self.edges))
        if not (descending and self.edges[0] <= 90 and self.edges[-1] >= -90):
            reason = f"inclination from {self.edges[-1]:g} to {self.edges[0]:g} degrees"
            raise _wrong(reason, "Rows must follow one another within -90 and 90.")

    @classmethod
    def even(
        cls, rows: int, columns: int, inclination: Extent, azimuth: Extent = ALL_AROUND
    ) -> Self:
        """A grid with rows of equal height.

        Args:
            rows: Number of rows.
            columns: Number of columns.
            inclination: Lower and upper bound, degrees.
            azimuth: Right and left bound, degrees.

        Raises:
            InputError: Bounds that leave no room, or that no direction can have.
        """
        bottom, top = inclination
        edges = np.linspace(top, bottom, max(rows, 0) + 1)
        return cls(columns, azimuth, tuple(edges.tolist()))

    @classmethod
    def of_beams(cls, beams: Sequence[float], columns: int, azimuth: Extent = ALL_AROUND) -> Self:
        """A grid with one row a beam: borders midway between beams, half a step beyond the last.

        Args:
            beams: Inclinations of two or more beams in any order, degrees.
            columns: Number of columns.
            azimuth: Right and left bound, degrees.

        Raises:
            InputError: Fewer than two beams, equal ones, or bounds that no direction can have.
        """
        if len(beams) < 2:
            raise _wrong("fewer than two beams", "Give rows and inclination instead.")
        table = np.sort(np.asarray(beams, np.float64))[::-1]
        half = -np.diff(table) / 2
        edges = np.concatenate([[table[0] + half[0]], table[1:] + half, [table[-1] - half[-1]]])
        return cls(columns, azimuth, tuple(np.clip(edges, -90, 90).tolist()))

    @property
    def rows(self) -> int:
        """H, the number of rows."""
        return len(self.edges) - 1

    @property
    def is_full_circle(self) -> bool:
        """True where the last column is the neighbour of the first."""
        right, left = self.azimuth
        return left - right == FULL_CIRCLE

    def pixel(self, xyz: Float32s) -> Ints:
        """The pixel that each point falls into.

        On an even grid this is the published projection, except that it clamps points beyond the
        upper and lower bound into the outermost rows, and a pixel that holds -180 degrees holds
        180 degrees too.

        Args:
            xyz: Finite coordinates, float32 (N, 3), metres in the sensor frame.

        Returns:
            row · W + column, int64 (N,); -1 outside the grid.

        Source: Milioto et al. 2019, RangeNet++, eq. 1; github.com/TiagoCortinhal/SalsaNext,
            train/common/laserscan.py.
        """
        pixel = self.table(xyz)
        # The few points near a border of pixels take trigonometry.
        unsure = np.flatnonzero(pixel < UNSURE_BELOW)
        azimuth, inclination = directions(xyz.take(unsure, axis=0))
        # With one OUTSIDE the sum is negative, whatever the other is.
        pixel[unsure] = self._first_pixel(inclination) + self._column(azimuth)
        return np.maximum(pixel, -1, out=pixel)

    def _first_pixel(self, inclination: Floats) -> Ints:
        """First pixel of the row, int64 (N,); OUTSIDE where it is none of the grid's."""
        ascending = np.array(self.edges[::-1])
        # Rows are counted from the top, and the lowest edge belongs to the last of them.
        row = self.rows - np.searchsorted(ascending, inclination, side="left")
        row = np.minimum(row, self.rows - 1)
        inside = (inclination >= ascending[0]) & (inclination <= ascending[-1])
        return np.where(inside, row * self.columns, OUTSIDE)

    def _column(self, azimuth: Floats) -> Ints:
        """Column, int64 (N,); OUTSIDE where it is none of the grid's."""
        right, left = self.azimuth
        from_left = (left - azimuth) % FULL_CIRCLE
        # Multiplied before it is divided: that is exact for the usual bounds and round azimuths.
        column = (from_left * self.columns / (left - right)).astype(np.int64)
        column = np.minimum(column, self.columns - 1)  # the right bound belongs to the last
        return np.where(from_left <= left - right, column, OUTSIDE)

    @cached_property
    def table(self) -> DirectionTable:
        """Finds the pixels of nearly all points, without trigonometry."""
        right, left = self.azimuth
        borders = np.linspace(left, right, self.columns + 1)
        return DirectionTable(np.array(self.edges), self._first_pixel, borders, self._column)

    def as_dict(self) -> dict[str, Any]:
        """The grid as JSON-able primitives, which :func:`grid_of` reads back."""
        azimuth, edges = list(self.azimuth), list(self.edges)
        return {"columns": self.columns, "azimuth": azimuth, "edges": edges}


def grid_of(config: str | Mapping[str, Any], source: str | Path) -> SphericalGrid:
    """The grid that a user, or a Spec, describes.

    Args:
        config: Name of a published grid; or a mapping with ``columns``, ``azimuth`` (right and
            left bound; all around by default) and how the rows lie: ``rows`` and ``inclination``
            (lower and upper bound), or ``beams``, or ``edges``. Degrees.
        source: Source of the entry, for messages.

    Raises:
        InputError: An unknown name, or something that does not describe a grid.
    """
    return grid_at(Entry(source, "", config))


def grid_at(entry: Entry) -> SphericalGrid:
    """Reads a grid from a document, as :func:`grid_of` takes it.

    Raises:
        InputError: An unknown name, or something that does not describe a grid.
    """
    if isinstance(entry.value, str):
        if entry.value not in PUBLISHED_GRIDS:
            published = ", ".join(PUBLISHED_GRIDS)
            remedy = f"Available: {published}; or describe one by columns, rows and inclination."
            raise entry.fault(f"there is no grid named {shown(entry.value)}", remedy)
        entry = Entry(entry.source, entry.key, PUBLISHED_GRIDS[entry.value])
    parts = {"azimuth": ALL_AROUND, **entry.record(_PARSERS, required=("columns",))}
    columns, azimuth = parts.pop("columns"), parts.pop("azimuth")
    try:
        match sorted(parts):
            case ["inclination", "rows"]:
                return SphericalGrid.even(parts["rows"], columns, parts["inclination"], azimuth)
            case ["beams"]:
                return SphericalGrid.of_beams(parts["beams"], columns, azimuth)
            case ["edges"]:
                return SphericalGrid(columns, azimuth, parts["edges"])
    except InputError as error:
        raise entry.fault(f"a grid of {error.reason}", error.remedy) from error
    reason = f"its rows are described by {', '.join(parts) or 'nothing'}"
    raise entry.fault(reason, "Give rows with inclination, or beams, or edges.")


# What reads each part of a grid's description. No image has more rows or columns than pixels.
_PARSERS: dict[str, Callable[[Entry], Any]] = {
    "columns": lambda entry: entry.whole(1, MOST_PIXELS),
    "rows": lambda entry: entry.whole(1, MOST_PIXELS),
    "azimuth": lambda entry: entry.numbers(2),
    "inclination": lambda entry: entry.numbers(2),
    "beams": Entry.numbers,
    "edges": Entry.numbers,
}


def _wrong(reason: str, remedy: str) -> InputError:
    return InputError("grid", reason, remedy)
