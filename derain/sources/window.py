"""A window: which scans of a sequence a method sees besides the one that is judged."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from derain.files.documents import Entry
from derain.scan import Floats, Scan
from derain.sources.frame import Frame

# Scans kept at a time are bounded: each takes some 30 MB with its neighbours and rays.
MOST_SCANS = 50


@dataclass(frozen=True)
class Window:
    """Number of scans before and after one that a method needs; none by default.

    Attributes:
        before: Scans before it in its sequence.
        after: Scans after it, for which the answer has to wait.

    Raises:
        InputError: Other numbers than 0 to 50.
    """

    before: int = 0
    after: int = 0

    def __post_init__(self) -> None:
        for name in ("before", "after"):  # whatever a user gave
            value = getattr(self, name)
            if isinstance(value, np.integer):
                value = int(value)
                object.__setattr__(self, name, value)
            Entry("window", name, value).whole(0, MOST_SCANS)

    @property
    def is_one_scan(self) -> bool:
        """True if the method needs only the scan that is judged."""
        return not (self.before or self.after)


@dataclass(frozen=True, eq=False)
class PlacedScan:
    """A scan of a sequence, and where the sensor took it.

    Attributes:
        frame: Its frame.
        scan: The scan, in the frame of its sensor.
        pose: Takes the sensor's frame to that of the world, float64 (4, 4), metres; None where it
            is not known.
        stretch: Scans of one number have poses in one world, with none in doubt between them.
    """

    frame: Frame
    scan: Scan
    pose: Floats | None = None
    stretch: int = 0

    def to(self, other: "PlacedScan") -> Floats | None:
        """Takes the frame of this scan to that of another, float64 (4, 4); None if not known."""
        if self.pose is None or other.pose is None or self.stretch != other.stretch:
            return None
        return np.linalg.inv(other.pose) @ self.pose


@dataclass(frozen=True, eq=False)
class WindowOfScans:
    """A scan that is to be judged, and those around it in its sequence.

    Near the ends of a sequence there are fewer than in the method's :class:`Window`.

    Attributes:
        judged: The scan that is to be judged.
        before: Those before it, the oldest first.
        after: Those after it, the next one first.
    """

    judged: PlacedScan
    before: Sequence[PlacedScan] = ()
    after: Sequence[PlacedScan] = ()
