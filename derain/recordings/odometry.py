"""Where a sensor was, scan by scan, from nothing but its scans."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from derain.recordings.registration import Registration, Trust
from derain.recordings.surfaces import Fit, Surfaces
from derain.scan import Scan
from derain.sources.frame import Frame, time_of
from derain.system.cores import threads_of

# How far apart partners may be, metres: around the motion that is expected, and where nothing is
# expected: six scans of WADS on, 7.9 m, are found by the wider one.
WITHIN, WITHIN_AT_FIRST = 1.5, 8.0

NO_POINTS = Scan.of(np.zeros((0, 3), np.float32))


class Odometry:
    """Finds how a sensor moved, from one scan to the next, by GICP of the two.

    Each search starts from the last motion, which goes on for a moment whatever the driver does.
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
        self._expected: NDArray[np.float64] | None = None  # the last motion, which goes on
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
        """Lays a scan upon the one before: as the motion goes on, or else starting over."""
        if self._expected is not None:
            fit = surfaces.onto(before, self._expected, WITHIN)
            if not self._trust.misfit(fit):
                return fit
        afar = surfaces.onto(before, np.eye(4), WITHIN_AT_FIRST)
        return surfaces.onto(before, afar.motion, WITHIN)

    def _going_on(self, fit: Fit | None, reason: str) -> Registration:
        """Where the sensor would be if it had gone on as it did."""
        return self._moved(np.eye(4) if self._expected is None else self._expected, fit, reason)

    def _moved(self, motion: NDArray[np.float64], fit: Fit | None, reason: str) -> Registration:
        self._pose = self._pose @ motion
        residual, matched = (np.nan, 0.0) if fit is None else (fit.residual, fit.matched)
        return Registration(motion, self._pose, residual, matched, not reason, reason)


class FrameOdometry:
    """Odometry of frame after frame, which starts anew with each recording.

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
