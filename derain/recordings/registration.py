"""What is known of the motion between two scans, and whether it is to be trusted."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from derain.views.scan_issues import ScanIssue


@dataclass(frozen=True, eq=False)
class Registration:
    """Where a scan was taken, by the scan before it.

    Attributes:
        motion: Takes this scan's frame to that of the scan before, float64 (4, 4), metres; the
            identity for the first scan. Where nothing could be made of the two scans, the motion
            before this one goes on.
        pose: Takes this scan's frame to that of the first scan, float64 (4, 4), metres: the
            product of all motions so far.
        residual: Median distance of this scan's surfaces from those of the scan before, metres; NaN
            where no point found a partner.
        matched: Share of its points that found a partner in the scan before; 0..1.
        trusted: Whether the motion is what it seems to be.
        reason: Why not; empty where it is trusted.
    """

    motion: NDArray[np.float64]
    pose: NDArray[np.float64]
    residual: float
    matched: float
    trusted: bool
    reason: str

    @property
    def distance(self) -> float:
        """How far the sensor moved, metres."""
        return shift_of(self.motion)

    @property
    def turn(self) -> float:
        """By how much it turned, degrees, whatever about."""
        return turn_of(self.motion)

    def issues(self) -> Iterator[ScanIssue]:
        """Says so where it is not to be trusted."""
        if not self.trusted:
            detail = f"where it was taken is not known: {self.reason}"
            yield ScanIssue("its place is not known", detail)


def shift_of(motion: NDArray[np.float64]) -> float:
    """Length of a motion, metres.

    Args:
        motion: A rigid motion, float64 (4, 4).
    """
    return float(np.linalg.norm(motion[:3, 3]))


def turn_of(motion: NDArray[np.float64]) -> float:
    """Angle of a rotation about its own axis, degrees, 0..180.

    Args:
        motion: A rigid motion, float64 (4, 4).
    """
    # By the sine as well: the cosine alone loses half of the digits near 0.
    rotation = motion[:3, :3]
    axis = rotation[[2, 0, 1], [1, 2, 0]] - rotation[[1, 2, 0], [2, 0, 1]]
    return float(np.degrees(np.arctan2(np.linalg.norm(axis), np.trace(rotation) - 1)))
