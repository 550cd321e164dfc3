"""Where a sensor was, scan by scan, from nothing but its scans."""

import numpy as np
from numpy.typing import NDArray

from derain.recordings.registration import Registration
from derain.recordings.surfaces import Fit, Surfaces
from derain.recordings.trust import Trust
from derain.scan import Scan
from derain.system.cores import threads_of

# How far apart partners may be, metres: around the motion that is expected, and where nothing is
# expected: six scans of WADS on, 7.9 m, are found by the wider one.
WITHIN, WITHIN_AT_FIRST = 1.5, 8.0


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
