"""The last frames of a recording, each where it was taken: by its pose, or else by odometry."""

from abc import abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import ClassVar
from weakref import WeakKeyDictionary, ref

import numpy as np

from derain.errors import InputError
from derain.files.reading import reading
from derain.recordings.odometry import FrameOdometry
from derain.recordings.rays import RayEvidence
from derain.scan import Array, Scan
from derain.sources.frame import Frame
from derain.sources.judgement import Judgement
from derain.sources.method import Method
from derain.sources.recent_frames import RecentFrames, ScanError
from derain.sources.window import PlacedScan, Window, WindowOfScans
from derain.system.stopwatch import Stopwatch
from derain.views.scan_issues import ScanIssue

# Kind of the issue of a frame whose record of its pose is damaged.
SOUGHT = "its pose is computed from the scans"

SUCH_SCANS = "; scans like it are judged without those before them, and only the first is named"

UNLIKE = ScanIssue(
    "unlike the scans around it",
    "the scans around it do not match it at its pose: the pose is wrong, or the scan is there "
    "twice; it is judged by itself",
)


class PlacedFrames(RecentFrames):
    """Takes frame after frame, places each, and returns it once those after it are there.

    Poses are those of the frames. Where a frame has none, or the record of it is damaged, they are
    found as it goes; where that fails, a new stretch begins, to which nothing before has a pose.

    Args:
        window: Frames before and after one that are to be seen with it.
        threads: Threads that odometry may use; 0 takes every core this process may use.

    Attributes:
        doubts: Doubts about the pose of each scan.
    """

    def __init__(self, window: Window, threads: int = 0) -> None:
        super().__init__(window)
        self._odometry = FrameOdometry(threads)
        self.doubts: WeakKeyDictionary[Scan, list[ScanIssue]] = WeakKeyDictionary()
        self._stretch = 0
        self._first_lost: ref[Scan] | None = None  # of this recording
        self._has_poses: bool | None = None  # whether the last frame had a pose; None before any

    def place(self, frame: Frame | Scan | Array, stopwatch: Stopwatch) -> WindowOfScans | None:
        """Reads and places the next frame; a new recording drops those still waiting.

        Args:
            frame: A frame; or a scan, or its points, which is taken for the next of one sequence.
            stopwatch: Takes the times of the stages read, and odometry where no pose is given.

        Returns:
            The frame that has all its window by now, if there is one.

        Raises:
            InputError: A frame that cannot be read.
        """
        if not isinstance(frame, Frame):
            frame = self.frame_of(Scan.of(frame))
        with stopwatch.stage("read"):
            scan = frame.read()  # an object of its own, even of a scan that is pushed again
        with stopwatch.stage("odometry"):
            placed = self._placed(frame, scan)
        return self.push(placed)

    def warnings(self, scan: Scan) -> Iterator[ScanIssue]:
        """Doubts about a scan's pose; that odometry does not know it, only for the first such scan.

        Of a folder of scans that have nothing in common, that is true of almost every one.
        """
        for doubt in self.doubts.get(scan, ()):
            if doubt.kind in (SOUGHT, UNLIKE.kind):
                yield doubt
            elif self._first_lost is not None and self._first_lost() is scan:
                yield replace(doubt, detail=doubt.detail + SUCH_SCANS)

    def _placed(self, frame: Frame, scan: Scan) -> PlacedScan:
        pose, doubts = None, []
        try:
            pose = frame.pose
        except InputError as error:
            detail = f"its pose is not known, and is computed from the scans: {error}"
            doubts.append(ScanIssue(SOUGHT, detail))
        has_pose = pose is not None
        starts = self.starts_new_recording(frame)
        if starts:
            self._first_lost = None
        if starts or self._has_poses not in (None, has_pose):
            self._stretch += 1  # another world
        self._has_poses = has_pose
        if pose is None:
            registration = self._odometry.register(frame, scan)
            doubts.extend(registration.issues())
            if not registration.trusted and self._first_lost is None:
                self._first_lost = ref(scan)
            self._stretch += not registration.trusted
            pose = registration.pose
        self.doubts[scan] = doubts
        return PlacedScan(frame, scan, pose, self._stretch)


class PlacedMethod(Method):
    """A method that sees the scans around the one that it judges, each where it was taken."""

    EXAMINE_EVERY: ClassVar[int] = 1  # any scan may be one whose place is not known

    _recent: PlacedFrames

    def depends_on(self, recording: Sequence[Frame]) -> Window | None:
        """Its window where all poses are known, else all scans, from which they are found."""
        return self.window if are_placed(recording) else None

    @property
    def waiting(self) -> int:
        """Number of frames that were pushed and not answered."""
        return self._recent.waiting

    def starts_new_recording(self, frame: Frame) -> bool:
        """True if a frame does not follow those that wait."""
        return self.waiting > 0 and self._recent.starts_new_recording(frame)

    def push(
        self, frame: Frame | Scan | Array, stopwatch: Stopwatch | None = None
    ) -> Judgement | None:
        """Takes the next frame of a recording; see :meth:`derain.sources.method.Method.push`.

        The stages are read, odometry where no pose is given, and those of the method.
        """
        stopwatch = stopwatch or Stopwatch()
        ready = self._recent.place(frame, stopwatch)
        return None if ready is None else self._answer(ready, stopwatch)

    def flush(self, stopwatch: Stopwatch | None = None) -> Iterator[Judgement]:
        """Ends a recording: answers for the frames that still wait, with the scans that there are.

        Args:
            stopwatch: Takes the times of the method's stages.

        Raises:
            InputError: A frame that cannot be judged.
        """
        while self.waiting:
            yield self._answer(self._recent.pop(), stopwatch or Stopwatch())
        self._end_recording()

    def _answer(self, scans: WindowOfScans, stopwatch: Stopwatch) -> Judgement:
        """Judges a frame that has its window, and warns of its issues.

        Raises:
            ScanError: It cannot be judged, for instance because the memory is full.
        """
        frame = scans.judged.frame
        try:
            with reading(Path(frame.name)):
                return self.with_warnings(self._judged(scans, stopwatch))
        except InputError as error:
            raise ScanError(frame, error) from error

    @abstractmethod
    def _judged(self, scans: WindowOfScans, stopwatch: Stopwatch) -> Judgement:
        """Judges a frame that has its window."""

    @abstractmethod
    def _end_recording(self) -> None:
        """Makes its ``PlacedFrames`` anew, and forgets what it has kept of scans."""


def is_alike(scan: Scan, other: Scan, evidence: RayEvidence) -> bool:
    """True if another scan matches one at its pose, and is not the same one again.

    Args:
        scan: The scan.
        other: The other scan.
        evidence: That of the other's rays at points of the scan that are solid, most of them.
    """
    # A scan that is there twice shows its own drops as what persists.
    is_same = np.array_equal(other.xyz, scan.xyz, equal_nan=True)
    return not is_same and bool(evidence.ending.sum() > evidence.through.sum())


def are_placed(recording: Sequence[Frame]) -> bool:
    """True if all frames of a recording have poses, so that none is found from its scans."""
    try:
        return all(frame.pose is not None for frame in recording)
    except InputError:  # a damaged record: see PlacedFrames
        return False
