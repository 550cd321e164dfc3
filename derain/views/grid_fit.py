"""Fits a spherical grid to a sensor's scans, without labels."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from derain.errors import InputError
from derain.scan import Scan
from derain.views import scan_pattern
from derain.views.range_image import RangeView
from derain.views.spherical_grid import ALL_AROUND, Extent, SphericalGrid

# Networks halve an image four times; columns come in 64 for the processor's sake.
ROW_MULTIPLE = 16
COLUMN_MULTIPLE = 64

# Even rows come to about this many pixels a return at most. It bounds the rows of clouds that no
# beams made; for scans whose beams cannot be found, the tests' worst is 5.
PIXELS_PER_RETURN = 8

# Number of scans for the sensor's beams and steps; its field of view is found from all scans.
SCANS = 4


@dataclass(frozen=True)
class GridFit:
    """A grid, and what the scans it was fitted to lose on it.

    Attributes:
        grid: The grid.
        beams: Inclinations of the sensor's beams from top to bottom, degrees, one a row of the
            grid; empty if the beams cannot be found and the rows are even.
        points: Valid points of all scans.
        hidden: Share of them whose pixel shows a nearer return.
        outside: Share of them outside the grid.
        empty: Share of pixels without a return.
    """

    grid: SphericalGrid
    beams: tuple[float, ...]
    points: int
    hidden: float
    outside: float
    empty: float

    def as_dict(self) -> dict[str, Any]:
        """The fit as JSON-able primitives, to be printed; angles in degrees, shares of 1."""
        edges = self.grid.edges
        return {
            "rows": self.grid.rows,
            "columns": self.grid.columns,
            "azimuth": [round(bound, 3) for bound in self.grid.azimuth],
            "inclination": [round(bound, 3) for bound in (edges[-1], edges[0])],
            "beams": len(self.beams) or "not found",
            "points": self.points,
            "points hidden by nearer ones": round(self.hidden, 4),
            "points outside": round(self.outside, 4),
            "pixels empty": round(self.empty, 4),
            "grid": self.grid.as_dict(),
        }


def fit_grid(scans: Sequence[Scan]) -> GridFit:
    """Fits a grid to what a sensor sees, and to its beams and its steps in azimuth.

    Args:
        scans: One or more scans of one sensor. Labels are not looked at.

    Raises:
        InputError: Not one valid point.
    """
    seen = [angles for scan in scans if len((angles := scan_pattern.ReturnAngles.of(scan)).azimuth)]
    if not seen:
        raise InputError("grid", "there is no valid point to fit it to", "Give a grid by its name.")
    inclinations = np.concatenate([angles.inclination for angles in seen])
    azimuth = scan_pattern.azimuth_extent(np.concatenate([angles.azimuth for angles in seen]))
    inclination = scan_pattern.inclination_extent(inclinations)
    returns = len(inclinations) / len(seen)
    some = seen[:: math.ceil(len(seen) / SCANS)]
    beams = scan_pattern.find_beams(some)
    if beams.size:
        edges = list(SphericalGrid.of_beams(beams.tolist(), columns=1).edges)
        columns, bounds = _columns(azimuth, scan_pattern.azimuth_step(some, edges[::-1]))
    else:
        step = scan_pattern.azimuth_step(some, _thin_slabs(azimuth, inclination, returns))
        columns, bounds = _columns(azimuth, step)
        most = PIXELS_PER_RETURN * returns / columns
        edges = _even_edges(inclination, scan_pattern.inclination_step(some, step), most)
    # Outliers are worth no rows of their own, but the outermost rows reach out to them.
    edges[0] = max(edges[0], float(inclinations.max()))
    edges[-1] = min(edges[-1], float(inclinations.min()))
    grid = SphericalGrid(columns, bounds, tuple(edges))
    return _measured(grid, tuple(beams.tolist()), scans)


def _thin_slabs(azimuth: Extent, inclination: Extent, returns: float) -> list[float]:
    """Borders of slabs half as thick as the returns would be apart if evenly spread.

    Beams are farther apart than that, as sensors scan more finely in azimuth.
    """
    (right, left), (bottom, top) = azimuth, inclination
    thickness = math.sqrt((left - right) * (top - bottom) / returns) / 2
    return np.arange(bottom, top, max(thickness, scan_pattern.FINEST_STEP)).tolist()


def _columns(azimuth: Extent, step: float) -> tuple[int, Extent]:
    """Number of columns, and their bounds."""
    right, left = azimuth
    if azimuth == ALL_AROUND:
        return _round_up((left - right) / step, COLUMN_MULTIPLE), azimuth
    return _round_up((left - right) / step + 1, COLUMN_MULTIPLE), _widened(azimuth, step)


def _even_edges(inclination: Extent, step: float, most: float) -> list[float]:
    """Borders of evenly spaced rows, of about the sensor's step and not many more than ``most``."""
    bottom, top = inclination
    rows = _round_up(min((top - bottom) / step + 1, most), ROW_MULTIPLE)
    bottom, top = _widened(inclination, step)
    edges: list[float] = np.linspace(min(top, 90), max(bottom, -90), rows + 1).tolist()
    return edges


def _widened(extent: Extent, step: float) -> Extent:
    """From the middle of the outermost pixels to their borders."""
    margin = min(step, scan_pattern.REAL_GAP) / 2  # no step may close the gap that a sensor leaves
    return extent[0] - margin, extent[1] + margin


def _round_up(count: float, multiple: int) -> int:
    # Half a step more is the noise of the measured step, and worth no further columns.
    return max(math.ceil((count - 0.5) / multiple), 1) * multiple


def _measured(grid: SphericalGrid, beams: tuple[float, ...], scans: Sequence[Scan]) -> GridFit:
    points = hidden = outside = filled = 0
    view = RangeView(grid, channels=())
    for scan in scans:
        image, valid = view(scan), scan.valid
        points += int(valid.sum())
        hidden += int(image.hidden.sum())
        outside += int((valid & (image.pixel < 0)).sum())
        filled += int(image.valid.sum())
    empty = 1 - filled / (len(scans) * grid.rows * grid.columns)
    return GridFit(grid, beams, points, hidden / points, outside / points, empty)
