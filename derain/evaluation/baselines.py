"""Baselines that a derainer must beat before its scores are evidence that it detects rain.

They call every point rain, or none, or those at places where training scans had rain. A fourth,
which calls dim and near points rain, is in :mod:`derain.evaluation.intensity_rule`.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from derain.errors import InputError
from derain.evaluation.counts import intersection_over_union
from derain.scan import Scan

# Bits of a voxel's number along each axis; three of them fit into an int64.
AXIS_BITS = 21


def all_points(scan: Scan) -> NDArray[np.bool_]:
    """Calls every valid point rain, bool (N,)."""
    return scan.valid


def no_points(scan: Scan) -> NDArray[np.bool_]:
    """Calls no point rain, bool (N,)."""
    return np.zeros(len(scan), bool)


@dataclass(frozen=True, eq=False)
class PositionPrior:
    """Calls a point rain if training scans mostly had rain at its position.

    It uses neither intensity nor neighbours. Where all scans show the same scene, as in
    REHEARSE-3D, it scores well without detecting rain: a method that does not beat it there may
    have learnt the places only.

    Attributes:
        voxel: Edge of the voxels in metres, which are fixed to the sensor.
        rain: Numbers of the voxels of rain, int64 (V,), ascending. Any other voxel is not rain,
            including those without points in training.
    """

    voxel: float
    rain: NDArray[np.int64]

    def __call__(self, scan: Scan) -> NDArray[np.bool_]:
        """True for the points called rain, bool (N,)."""
        valid = scan.valid
        called_rain = np.zeros(len(scan), bool)
        called_rain[valid] = np.isin(_voxel_of(scan.xyz[valid], self.voxel), self.rain)
        return called_rain

    @classmethod
    def learn(cls, scans: Iterable[tuple[Scan, NDArray[np.bool_]]], voxel: float = 0.5) -> Self:
        """Finds the voxels that, called rain, give the greatest IoU on the training scans.

        They are those with the greatest shares of rain. One point with the average share of rain is
        added to each voxel: otherwise a voxel with a single point of rain would come first.

        Args:
            scans: Scans, and their rain, bool (N,). One is in memory at a time.
            voxel: Edge of the voxels, metres.

        Returns:
            The prior; without rain to learn from, it calls nothing rain.

        Raises:
            InputError: Voxels without an extent.
        """
        if not (voxel > 0 and math.isfinite(voxel)):
            raise InputError("voxel", f"{voxel:g} m", "Give a finite length above 0.")
        seen = _Voxels.none()
        for scan, rain in scans:
            seen = seen.joined(_Voxels.of(scan.xyz[scan.valid], rain[scan.valid], voxel))
        return cls(voxel, np.sort(seen.number[seen.best()]))


class _Voxels(NamedTuple):
    """Distinct voxels by number, ascending, with their points and their points of rain."""

    number: NDArray[np.int64]
    points: NDArray[np.int64]
    rain: NDArray[np.int64]

    @classmethod
    def none(cls) -> "_Voxels":
        empty = np.zeros(0, np.int64)
        return cls(empty, empty, empty)

    @classmethod
    def of(cls, xyz: NDArray[np.float32], rain: NDArray[np.bool_], voxel: float) -> "_Voxels":
        ones = np.ones(len(xyz), np.int64)
        return _added_up(_voxel_of(xyz, voxel), ones, rain.astype(np.int64))

    def joined(self, other: "_Voxels") -> "_Voxels":
        return _added_up(*(np.concatenate(pair) for pair in zip(self, other, strict=True)))

    def best(self) -> NDArray[np.int64]:
        """Rows of the voxels that are best called rain, by descending share."""
        total = self.rain.sum()
        if not total:
            return np.zeros(0, np.int64)
        share = (self.rain + total / self.points.sum()) / (self.points + 1)
        order = np.argsort(-share, kind="stable")
        hits, called = np.cumsum(self.rain[order]), np.cumsum(self.points[order])
        iou = intersection_over_union(hits, total - hits + called - hits)
        # Voxels with equal shares are called alike: a choice ends at the last of them.
        iou[:-1][np.diff(share[order]) == 0] = 0
        return order[: np.argmax(iou) + 1]


def _voxel_of(xyz: NDArray[np.float32], voxel: float) -> NDArray[np.int64]:
    """Number of each point's voxel, int64 (N,); points beyond the outermost voxels lie in those."""
    half = 2 ** (AXIS_BITS - 1)
    cell = np.clip(np.floor(xyz.astype(np.float64) / voxel), -half, half - 1).astype(np.int64)
    x, y, z = (cell + half).T
    number: NDArray[np.int64] = (x << 2 * AXIS_BITS) | (y << AXIS_BITS) | z
    return number


def _added_up(
    number: NDArray[np.int64], points: NDArray[np.int64], rain: NDArray[np.int64]
) -> _Voxels:
    """Distinct voxels: the counts of those that occur more than once are added up."""
    distinct, row = np.unique(number, return_inverse=True)
    # bincount adds in float64, which is exact up to 2⁵³ points.
    sums = (np.bincount(row, counts, len(distinct)) for counts in (points, rain))
    return _Voxels(distinct, *(total.astype(np.int64) for total in sums))
