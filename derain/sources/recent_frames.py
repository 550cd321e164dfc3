"""The frames of a recording that a window needs, kept as they come in."""

from collections import deque
from pathlib import Path

from derain.errors import InputError
from derain.scan import Scan
from derain.sources.frame import Frame, MemoryFrame
from derain.sources.window import PlacedScan, Window, WindowOfScans


class ScanError(InputError):
    """A frame that was pushed, perhaps some frames ago, and cannot be judged.

    Args:
        frame: The frame.
        error: Why; of an error that does not name the frame, the reason begins with its subject.

    Attributes:
        frame: The frame.
    """

    def __init__(self, frame: Frame, error: InputError) -> None:
        named = str(error.subject) == frame.name
        reason = error.reason if named else f"{error.subject}: {error.reason}"
        super().__init__(frame.name, reason, error.remedy)
        self.frame = frame

    def __reduce__(self) -> tuple[type[InputError], tuple[str | Path, str, str]]:
        return InputError, (self.subject, self.reason, self.remedy)


class RecentFrames:
    """Takes frame after frame, and returns each once the frames after it have arrived.

    A frame that does not follow the one before it, in another sequence or with some missing
    between, starts a new recording: no window reaches over the gap.

    Args:
        window: Number of frames before and after each that are used with it.
    """

    def __init__(self, window: Window) -> None:
        self.window = window
        self._kept: deque[PlacedScan] = deque()
        self._given = 0  # number of kept frames already returned; later frames still need them

    @property
    def waiting(self) -> int:
        """Number of frames that were taken and not returned yet."""
        return len(self._kept) - self._given

    def frame_of(self, scan: Scan) -> Frame:
        """A frame of a scan alone, as the one that would follow."""
        number = self._kept[-1].frame.number + 1 if self._kept else 0
        return MemoryFrame(key=f"{number:06d}", number=number, scan=scan)

    def starts_new_recording(self, frame: Frame) -> bool:
        """True if a frame does not follow those that were taken."""
        return bool(self._kept) and not frame.follows(self._kept[-1].frame)

    def push(self, placed: PlacedScan) -> WindowOfScans | None:
        """Takes the next frame; a new recording drops those still waiting.

        Args:
            placed: The frame, its scan, and where it was taken as far as that is needed.

        Returns:
            The frame whose window is now complete, if there is one.
        """
        if self.starts_new_recording(placed.frame):
            self._kept.clear()
            self._given = 0
        self._kept.append(placed)
        return self.pop() if self.waiting > self.window.after else None

    def pop(self) -> WindowOfScans:
        """Gives the oldest waiting frame with what there is of its window."""
        place = self._given
        scans = [*self._kept]
        after = scans[place + 1 : place + 1 + self.window.after]
        before = scans[max(place - self.window.before, 0) : place]
        self._given += 1
        while self._given > self.window.before:  # no later window reaches back so far
            self._kept.popleft()
            self._given -= 1
        return WindowOfScans(scans[place], before, after)
