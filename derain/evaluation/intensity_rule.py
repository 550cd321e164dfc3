"""The baseline that calls dim and near points rain."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from derain.evaluation.counts import intersection_over_union
from derain.scan import Scan
from derain.views.scan_issues import ScanIssue, missing_intensity

# Most limits of intensity, and of range, that are tried.
MOST_LIMITS = 200


@dataclass(frozen=True)
class IntensityRule:
    """Calls a point rain if its intensity and its range are both small.

    On the WADS sample, "intensity 0 and nearer than 20 m" reaches an IoU of .72: a method that
    does not beat it is of no use.

    Attributes:
        intensity: Largest intensity of rain, in the unit of the scans.
        range: Largest range of rain, in metres.
    """

    intensity: float
    range: float

    def __call__(self, scan: Scan) -> NDArray[np.bool_]:
        """True for the points called rain, bool (N,); none in a scan without intensity."""
        intensity = scan.measured_intensity
        if intensity is None:
            return np.zeros(len(scan), bool)
        dim: NDArray[np.bool_] = intensity <= self.intensity
        return dim & (scan.range <= self.range) & scan.valid

    def issues(self, scan: Scan) -> Iterator[ScanIssue]:
        """Warns of a scan without intensity. Its unit is not checked."""
        yield from missing_intensity(scan)

    @classmethod
    def best(cls, scans: Iterable[tuple[Scan, NDArray[np.bool_]]]) -> Self:
        """Finds the two limits of the greatest IoU.

        Args:
            scans: Scans, and their rain, bool (N,). Those without intensity are skipped.

        Returns:
            The rule; without rain to learn from, it calls nothing rain.
        """
        parts = [
            (intensity[scan.valid], scan.range[scan.valid], rain[scan.valid])
            for scan, rain in scans
            if (intensity := scan.measured_intensity) is not None
        ]
        if not any(rain.any() for _, _, rain in parts):
            return cls(-np.inf, -np.inf)
        intensity, distance, rain = (np.concatenate(column) for column in zip(*parts, strict=True))
        # The best limit is a value of the rain itself. Of many values, those at evenly spaced
        # quantiles are tried.
        shares = np.linspace(0, 1, MOST_LIMITS)
        limits = [
            np.unique(np.quantile(column[rain], shares, method="lower"))
            for column in (intensity, distance)
        ]
        # A point's cell is the pair of the lowest limits that it passes.
        cells = [
            np.searchsorted(limit, column)
            for limit, column in zip(limits, (intensity, distance), strict=True)
        ]
        hits, false = (_within(cells, chosen, limits) for chosen in (rain, ~rain))
        iou = intersection_over_union(hits, rain.sum() - hits + false)
        row, column = np.unravel_index(np.argmax(iou), iou.shape)
        return cls(float(limits[0][row]), float(limits[1][column]))


def _within(
    cells: list[NDArray[np.int64]], chosen: NDArray[np.bool_], limits: list[NDArray[np.float32]]
) -> NDArray[np.int64]:
    """Number of the chosen points that pass each pair of limits."""
    shape = tuple(len(limit) + 1 for limit in limits)
    flat = np.ravel_multi_index([cell[chosen] for cell in cells], shape)
    counts = np.bincount(flat, minlength=shape[0] * shape[1]).reshape(shape)
    return counts.cumsum(axis=0).cumsum(axis=1)[:-1, :-1]
