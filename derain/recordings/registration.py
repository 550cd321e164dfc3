"""The motion between two scans, and whether it is to be trusted.

A registration is trusted where the scans fit, and where a vehicle could have driven so.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from statistics import median

import numpy as np
from numpy.typing import NDArray

from derain.recordings.surfaces import Fit
from derain.views.scan_issues import ScanIssue

# Scans a tenth to three tenths of a second apart, of a car at 13 m/s (WADS) or one that stands
# (SnowyKITTI), have .71 to .94 of their surfaces within a voxel of one another, .01 to .08 m apart.
# Scans of different places, laid upon one another as well as it goes, have .03 to .34, .20 m apart.
# The bounds are half way. (Unlabelled scans of those two sets, laid upon one another and mixed.)
LEAST_MATCHED = 0.5
MOST_APART = 0.13

# A scan that fits several times worse than those before it does not belong there, even if another
# sensor would be glad of such a fit; three make a habit. But as well as those of a car at 13 m/s is
# well enough: of one that stands every scan is like the last, until it drives off.
TIMES_THE_USUAL = 3.0
FEWEST_USUAL = 3
WELL_ENOUGH = 0.08

# Share of surfaces that must face every direction. A flat road has 0 of them along itself; the
# scans above, and simulated streets (spinning_64 and mems_64, 0 to 200 mm/h), have .02 or more. Of
# 10,000 surfaces a two-hundredth still is 50, of 5 cm noise each, which know the motion to 1 cm.
LEAST_FACING = 0.005

# What no vehicle does between two scans, where they are taken five times a second or more often:
# turn by 100 degrees a second, or change its motion by more than tyres hold, 10 m/s², would by the
# square of a fifth of a second (.4 m), with .1 m for what registration itself is off by.
# Source: D. Gillespie, "Fundamentals of Vehicle Dynamics", SAE 1992: dry asphalt holds about 1 g.
LARGEST_TURN = 20.0
LARGEST_CHANGE = 0.5
LARGEST_CHANGE_OF_TURN = 10.0


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


class Trust:
    """What the scans of a sequence were like so far, and whether the next one is like them."""

    def __init__(self) -> None:
        self._residuals: list[float] = []
        self._motions: list[NDArray[np.float64]] = []  # the last trusted one, and the last one

    def misfit(self, fit: Fit) -> str:
        """Why two scans do not lie upon one another; empty where they do.

        Args:
            fit: How they lie.
        """
        if fit.matched < LEAST_MATCHED:
            return (
                f"only {fit.matched:.0%} of its surfaces are where the scan before has some: it is "
                "of another place, or too far on"
            )
        if fit.residual > (most := self._most_apart()):
            return (
                f"its surfaces lie {fit.residual:.3f} m from those of the scan before, where "
                f"{most:.3f} m is the most"
            )
        if fit.facing < LEAST_FACING:
            return (
                "too little stands across some direction to tell how far the sensor went along it"
            )
        return "" if fit.converged else "the search for the motion did not come to rest"

    def unlikely(self, motion: NDArray[np.float64]) -> str:
        """Why no vehicle moves so between two scans; empty where one may.

        Args:
            motion: Takes a scan's frame to that of the scan before, float64 (4, 4), metres.
        """
        if turn_of(motion) > LARGEST_TURN:
            return (
                f"a turn by {turn_of(motion):.0f} degrees between two scans: they are out of order "
                "or far apart"
            )
        changes = [np.linalg.inv(earlier) @ motion for earlier in self._motions]
        if not changes or any(map(_is_small, changes)):
            return ""
        least = min(changes, key=shift_of)
        return (
            f"{shift_of(motion):.1f} m from the scan before, {shift_of(least):.1f} m off what the "
            "motion so far leads to: the scans are out of order or far apart"
        )

    def remember(self, fit: Fit, trusted: bool) -> None:
        """Takes a registration that fits into what is usual.

        Args:
            fit: How the two scans lie upon one another.
            trusted: Whether a vehicle may have moved so.
        """
        if trusted:
            self._residuals.append(fit.residual)
        believed = fit.motion if trusted or not self._motions else self._motions[0]
        self._motions = [believed, fit.motion]

    def _most_apart(self) -> float:
        """The largest residual of a scan that fits, metres."""
        if len(self._residuals) < FEWEST_USUAL:
            return MOST_APART
        return min(MOST_APART, max(WELL_ENOUGH, TIMES_THE_USUAL * median(self._residuals)))


def _is_small(change: NDArray[np.float64]) -> bool:
    return shift_of(change) <= LARGEST_CHANGE and turn_of(change) <= LARGEST_CHANGE_OF_TURN
