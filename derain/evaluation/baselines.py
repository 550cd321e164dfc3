"""Baselines that a derainer must beat before its scores are evidence that it detects rain.

They call every point rain, or none, those at places where training scans had rain, or those that
are dim and near.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Self

import numpy as np

from derain.evaluation.counts import intersection_over_union, table_of
from derain.scan import Array, Bools, Float32s, Floats, Ints, Scan
from derain.views.scan_issues import ScanIssue, missing_intensity

# Edge of the voxels, metres, in which it is learnt where it rains.
VOXEL = 0.5

# Bits of a voxel's number along each axis; three of them fit into an int64.
AXIS_BITS = 21

# Most limits of intensity, and of range, that are tried.
MOST_LIMITS = 200


def all_points(scan: Scan) -> Bools:
    """Calls every valid point rain, bool (N,)."""
    return scan.valid


def no_points(scan: Scan) -> Bools:
    """Calls no point rain, bool (N,)."""
    return np.zeros(len(scan), bool)


@dataclass(frozen=True, eq=False)
class PositionPrior:
    """Calls a point rain if training scans mostly had rain at its position.

    It uses neither intensity nor neighbours. Where all scans show the same scene, as in
    REHEARSE-3D, it scores well without detecting rain: a method that does not beat it there may
    have learnt the places only.

    Attributes:
        rain: Numbers of the voxels of rain, int64 (V,), ascending; the voxels are fixed to the
            sensor. Any other voxel is not rain, including those without points in training.
    """

    rain: Ints

    def __call__(self, scan: Scan) -> Bools:
        """True for the points called rain, bool (N,)."""
        valid = scan.valid
        called_rain = np.zeros(len(scan), bool)
        called_rain[valid] = np.isin(_voxel_of(scan.xyz[valid]), self.rain)
        return called_rain

    @classmethod
    def learn(cls, scans: Iterable[tuple[Scan, Bools]]) -> Self:
        """Finds the voxels that, called rain, give the greatest IoU on the training scans.

        They are those with the greatest shares of rain. One point with the average share of rain is
        added to each voxel: otherwise a voxel with a single point of rain would come first.

        Args:
            scans: Scans, and their rain, bool (N,). One is in memory at a time.

        Returns:
            The prior; without rain to learn from, it calls nothing rain.
        """
        number = np.zeros(0, np.int64)
        points: Array = np.zeros(0)
        hits: Array = np.zeros(0)
        for scan, rain in scans:
            own = _voxel_of(scan.xyz[scan.valid])
            number, row = np.unique(np.append(number, own), return_inverse=True)
            # bincount adds in float64, which is exact up to 2⁵³ points.
            points = np.bincount(row, np.append(points, np.ones(len(own))), len(number))
            hits = np.bincount(row, np.append(hits, rain[scan.valid]), len(number))
        return cls(np.sort(number[_best_called_rain(points, hits)]))


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

    def __call__(self, scan: Scan) -> Bools:
        """True for the points called rain, bool (N,); none in a scan without intensity."""
        intensity = scan.measured_intensity
        if intensity is None:
            return np.zeros(len(scan), bool)
        dim: Bools = intensity <= self.intensity
        return dim & (scan.range <= self.range) & scan.valid

    def issues(self, scan: Scan) -> Iterator[ScanIssue]:
        """Warns of a scan without intensity. Its unit is not checked."""
        yield from missing_intensity(scan)

    @classmethod
    def best(cls, scans: Iterable[tuple[Scan, Bools]]) -> Self:
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
        limits = _limits_of(intensity[rain]), _limits_of(distance[rain])
        # Number of the lowest limit of each kind that a point passes; it passes all above, too.
        lowest = np.searchsorted(limits[0], intensity), np.searchsorted(limits[1], distance)
        shape = (len(limits[0]) + 1, len(limits[1]) + 1, 2)
        by_lowest = table_of((*lowest, rain.astype(np.int64)), shape)
        passing = by_lowest.cumsum(axis=0).cumsum(axis=1)[:-1, :-1]  # without those past all limits
        false, hits = passing[..., 0], passing[..., 1]
        iou = intersection_over_union(hits, rain.sum() - hits + false)
        row, column = np.unravel_index(np.argmax(iou), iou.shape)
        return cls(float(limits[0][row]), float(limits[1][column]))


def _limits_of(values: Float32s) -> Float32s:
    """Limits to try, ascending, float32 (L,): the best one is a value of the rain itself.

    Args:
        values: Intensity or range of every point of rain, float32 (R,). Of many, those at evenly
            spaced quantiles are tried.
    """
    shares = np.linspace(0, 1, MOST_LIMITS)
    return np.unique(np.quantile(values, shares, method="lower"))


def _best_called_rain(points: Floats, rain: Floats) -> Ints:
    """Rows of the voxels that are best called rain, by descending share of rain.

    Args:
        points: Points of each voxel, whole numbers, float64 (V,).
        rain: Its points of rain, whole numbers, float64 (V,).
    """
    total = rain.sum()
    if not total:
        return np.zeros(0, np.int64)
    share = (rain + total / points.sum()) / (points + 1)
    order = np.argsort(-share, kind="stable")
    hits, called = np.cumsum(rain[order]), np.cumsum(points[order])
    iou = intersection_over_union(hits, total - hits + called - hits)
    # Voxels with equal shares are called alike: a choice ends at the last of them.
    iou[:-1][np.diff(share[order]) == 0] = 0
    return order[: np.argmax(iou) + 1]


def _voxel_of(xyz: Float32s) -> Ints:
    """Number of each point's voxel, int64 (N,); points beyond the outermost voxels lie in those."""
    half = 2 ** (AXIS_BITS - 1)
    cell = np.clip(np.floor(xyz.astype(np.float64) / VOXEL), -half, half - 1).astype(np.int64)
    x, y, z = (cell + half).T
    number: Ints = (x << 2 * AXIS_BITS) | (y << AXIS_BITS) | z
    return number
