"""Poses of a sensor, scan by scan, from its scans alone.

A registration is trusted where the scans fit, and where a vehicle could have driven so.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from statistics import median

import numpy as np

from derain.recordings.surfaces import Fit, Surfaces
from derain.scan import Floats, Scan
from derain.sources.frame import Frame, time_of
from derain.system.cores import threads_of
from derain.views.scan_issues import ScanIssue

# How far apart partners may be, metres: around the motion that is expected, and where nothing is
# expected: six scans of WADS on, 7.9 m, are found by the wider one.
WITHIN, WITHIN_AT_FIRST = 1.5, 8.0

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
# 10,000 surfaces a two-hundredth still is 50, of 5 cm noise each, which give the motion to 1 cm.
LEAST_FACING = 0.005

# What no vehicle does between two scans, where they are taken five times a second or more often:
# turn by 100 degrees a second, or change its motion by more than tyres hold, 10 m/s², would by the
# square of a fifth of a second (.4 m), with .1 m for what registration itself is off by.
# Source: D. Gillespie, "Fundamentals of Vehicle Dynamics", SAE 1992: dry asphalt holds about 1 g.
LARGEST_TURN = 20.0
LARGEST_CHANGE = 0.5
LARGEST_CHANGE_OF_TURN = 10.0

NO_POINTS = Scan.of(np.zeros((0, 3), np.float32))


@dataclass(frozen=True, eq=False)
class Registration:
    """The pose of a scan, relative to the scan before it.

    Attributes:
        motion: Takes this scan's frame to that of the scan before, float64 (4, 4), metres; the
            identity for the first scan. Where nothing could be made of the two scans, the motion
            before this one goes on.
        pose: Takes this scan's frame to that of the first scan, float64 (4, 4), metres: the
            product of all motions so far.
        residual: Median distance of this scan's surfaces from those of the scan before, metres; NaN
            where no point found a partner.
        matched: Share of its points that found a partner in the scan before; 0..1.
        trusted: True if the motion is plausible.
        reason: Why not; empty where it is trusted.
    """

    motion: Floats
    pose: Floats
    residual: float
    matched: float
    trusted: bool
    reason: str

    @property
    def distance(self) -> float:
        """Distance that the sensor moved, metres."""
        return shift_of(self.motion)

    @property
    def turn(self) -> float:
        """Angle of the turn, degrees, about any axis."""
        return turn_of(self.motion)

    def issues(self) -> Iterator[ScanIssue]:
        """Yields an issue if it is not to be trusted."""
        if not self.trusted:
            detail = f"its pose is not known: {self.reason}"
            yield ScanIssue("its pose is not known", detail)


def shift_of(motion: Floats) -> float:
    """Length of a motion, metres.

    Args:
        motion: A rigid motion, float64 (4, 4).
    """
    return float(np.linalg.norm(motion[:3, 3]))


def turn_of(motion: Floats) -> float:
    """Angle of a rotation about its own axis, degrees, 0..180.

    Args:
        motion: A rigid motion, float64 (4, 4).
    """
    # By the sine as well: the cosine alone loses half of the digits near 0.
    rotation = motion[:3, :3]
    axis = rotation[[2, 0, 1], [1, 2, 0]] - rotation[[1, 2, 0], [2, 0, 1]]
    return float(np.degrees(np.arctan2(np.linalg.norm(axis), np.trace(rotation) - 1)))


class Trust:
    """Statistics of a sequence so far, and the check that the next scan fits them."""

    def __init__(self) -> None:
        self._residuals: list[float] = []
        self._motions: list[Floats] = []  # the last trusted one, and the last one

    def misfit(self, fit: Fit) -> str:
        """Reason why two scans cannot be registered; empty if they can.

        Args:
            fit: The fit.
        """
        if fit.matched < LEAST_MATCHED:
            return (
                f"only {fit.matched:.0%} of its surfaces match those of the scan before: it shows "
                "another place, or is too far away"
            )
        if fit.residual > (most := self._most_apart()):
            return (
                f"its surfaces lie {fit.residual:.3f} m from those of the scan before, more than "
                f"the limit of {most:.3f} m"
            )
        if fit.facing < LEAST_FACING:
            return "too few surfaces face some direction to measure the motion along it"
        return "" if fit.converged else "the search for the motion did not converge"

    def unlikely(self, motion: Floats) -> str:
        """Reason why no vehicle moves in this way between two scans; empty if one can.

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
            f"{shift_of(motion):.1f} m from the scan before, {shift_of(least):.1f} m off the "
            "prediction from the motion so far: the scans are out of order or far apart"
        )

    def remember(self, fit: Fit, trusted: bool) -> None:
        """Adds a registration that fits to the statistics.

        Args:
            fit: The fit of the two scans.
            trusted: True if a vehicle can move in this way.
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


def _is_small(change: Floats) -> bool:
    return shift_of(change) <= LARGEST_CHANGE and turn_of(change) <= LARGEST_CHANGE_OF_TURN


class Odometry:
    """Finds how a sensor moved, from one scan to the next, by GICP of the two.

    Each search starts from the last motion, which persists for a moment in any manoeuvre.
    Where that fails, and for the first two scans, it starts over with partners farther apart.

    Example:
        >>> odometry = Odometry()
        >>> wall = np.random.default_rng(0).uniform((10, -9, -2), (11, 9, 4), (4000, 3))
        >>> standing = odometry.register(Scan.of(wall))
        >>> moved = odometry.register(Scan.of(wall - [0.5, 0, 0]))  # the wall comes nearer
        >>> moved.trusted, round(moved.distance, 2)
        (True, 0.5)

    Args:
        threads: Threads to use; 0 takes every core this process may use. What is found does not
            depend on them.

    Source: the recipe is that of small_gicp's own odometry example (K. Koide, "small_gicp", JOSS
    2024), with the constant velocity of KISS-ICP (I. Vizzo et al., RA-L 2023).
    """

    def __init__(self, threads: int = 0) -> None:
        self._threads = threads_of(threads)
        self.restart()

    def restart(self) -> None:
        """Forgets all scans: the next one is the first of a sequence."""
        self._before: Surfaces | None = None
        self._expected: Floats | None = None  # the last motion, which goes on
        self._pose = np.eye(4)
        self._trust = Trust()

    def register(self, scan: Scan) -> Registration:
        """Takes the next scan of the sequence.

        Args:
            scan: The scan. Rain in it does no harm: drops find no partners.

        Returns:
            Where it was taken.
        """
        surfaces, before = Surfaces(scan, self._threads), self._before
        self._before = surfaces
        if before is None:
            return Registration(np.eye(4), self._pose, 0.0, 1.0, True, "")
        for of_which, each in (("the scan", surfaces), ("the scan before", before)):
            if not each.are_enough:
                return self._going_on(None, f"{of_which} has only {len(each)} surfaces in reach")
        fit = self._fit(surfaces, before)
        if reason := self._trust.misfit(fit):
            return self._going_on(fit, reason)
        reason = self._trust.unlikely(fit.motion)
        self._trust.remember(fit, trusted=not reason)
        if not reason:
            self._expected = fit.motion
        return self._moved(fit.motion, fit, reason)

    def _fit(self, surfaces: Surfaces, before: Surfaces) -> Fit:
        """Registers a scan to the one before, starting from the last motion or else from none."""
        if self._expected is not None:
            fit = surfaces.onto(before, self._expected, WITHIN)
            if not self._trust.misfit(fit):
                return fit
        afar = surfaces.onto(before, np.eye(4), WITHIN_AT_FIRST)
        return surfaces.onto(before, afar.motion, WITHIN)

    def _going_on(self, fit: Fit | None, reason: str) -> Registration:
        """The pose extrapolated at constant velocity."""
        return self._moved(np.eye(4) if self._expected is None else self._expected, fit, reason)

    def _moved(self, motion: Floats, fit: Fit | None, reason: str) -> Registration:
        self._pose = self._pose @ motion
        residual, matched = (np.nan, 0.0) if fit is None else (fit.residual, fit.matched)
        return Registration(motion, self._pose, residual, matched, not reason, reason)


class FrameOdometry:
    """Odometry of frame after frame, which starts again with each recording.

    Args:
        threads: Threads to use; 0 takes every core this process may use.
    """

    def __init__(self, threads: int = 0) -> None:
        self._odometry = Odometry(threads)
        self._before: Frame | None = None

    def register(self, frame: Frame, scan: Scan | None) -> Registration:
        """Takes the next frame.

        Args:
            frame: The frame.
            scan: Its scan; None where it cannot be read.

        Returns:
            Where it was taken, in the frame of the first scan of its recording. Besides what
            :class:`~derain.recordings.odometry.Odometry` returns, it is not trusted where the frame
            was taken before the one that it follows, as far as their times are known.
        """
        before, self._before = self._before, frame
        if before is None or not frame.follows(before):
            self._odometry.restart()
            before = None
        registration = self._odometry.register(NO_POINTS if scan is None else scan)
        if scan is None:
            return replace(registration, trusted=False, reason="it cannot be read")
        late = None if before is None else _too_late(frame, before)
        return registration if late is None else replace(registration, trusted=False, reason=late)


def _too_late(frame: Frame, before: Frame) -> str | None:
    """The reason not to trust a frame taken before the one that it follows; None without one."""
    time, earlier = time_of(frame), time_of(before)
    if time is None or earlier is None or time > earlier:
        return None
    return f"it was taken at {time:.3f} s, the scan before at {earlier:.3f} s: out of order"
