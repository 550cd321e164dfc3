"""Odometry over the frames of a source, recording by recording."""

from dataclasses import replace

import numpy as np

from derain.errors import InputError
from derain.recordings.odometry import Odometry
from derain.recordings.registration import Registration
from derain.scan import Scan
from derain.sources.frame import Frame

NO_POINTS = Scan.of(np.zeros((0, 3), np.float32))


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
    """Says so where a frame was taken before the one that it follows."""
    time, earlier = _time_of(frame), _time_of(before)
    if time is None or earlier is None or time > earlier:
        return None
    return f"it was taken at {time:.3f} s, the scan before at {earlier:.3f} s: out of order"


def _time_of(frame: Frame) -> float | None:
    """When it was taken; None where a record of that is damaged, which odometry can do without."""
    try:
        return frame.time
    except InputError:
        return None
