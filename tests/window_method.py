"""A method that sees the scans before and after one, for tests of what takes any method."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from derain.errors import InputError
from derain.scan import Array, Scan
from derain.sources.frame import Frame
from derain.sources.judgement import Judgement
from derain.sources.method import Method
from derain.sources.recent_frames import RecentFrames, ScanError
from derain.sources.window import PlacedScan, Window, WindowOfScans
from derain.system.stopwatch import Stopwatch
from derain.views.scan_issues import ScanIssue


@dataclass(frozen=True)
class Dimmer:
    """What the method below calls rain, and where it is sure of it."""

    rain_below: float = 20.0
    sure_within: float = 30.0


class Between(Method):
    """Calls dim points rain; it is sure of near ones, where scans are before and after.

    Attributes:
        poses: Poses of the scans that it has judged, with those around them.
    """

    def __init__(self, dimmer: Dimmer = Dimmer()) -> None:
        self.dimmer = dimmer
        self.poses: list[Any] = []
        self._recent = RecentFrames(self.window)

    @property
    def window(self) -> Window:
        return Window(1, 1)

    @property
    def waiting(self) -> int:
        return self._recent.waiting

    def starts_new_recording(self, frame: Frame) -> bool:
        return self.waiting > 0 and self._recent.starts_new_recording(frame)

    def push(
        self, frame: Frame | Scan | Array, stopwatch: Stopwatch | None = None
    ) -> Judgement | None:
        assert isinstance(frame, Frame)
        assert not frame.has_labels
        with (stopwatch or Stopwatch()).stage("read"):
            ready = self._recent.push(PlacedScan(frame, frame.read(), frame.pose))
        return None if ready is None else self._judged(ready)

    def flush(self, stopwatch: Stopwatch | None = None) -> Iterator[Judgement]:
        while self.waiting:
            yield self._judged(self._recent.pop())
        self._recent = RecentFrames(self.window)

    def issues(self, judgement: Judgement) -> Iterator[ScanIssue]:
        if judgement.known is not None and not judgement.known.any():
            yield ScanIssue("nothing known", "no point of it is known")

    def as_dict(self) -> dict[str, Any]:
        return {"method": "between", **asdict(self.dimmer)}

    def _judged(self, scans: WindowOfScans) -> Judgement:
        frame, scan = scans.judged.frame, scans.judged.scan
        if scan.intensity is None:
            error = InputError(frame.name, "it has no intensity", "Give another scan.")
            raise ScanError(frame, error)
        self.poses.append(scans.judged.pose)
        rain = scan.valid & (scan.intensity < self.dimmer.rain_below)
        whole = bool(scans.before and scans.after)
        known = (scan.range < self.dimmer.sure_within) & whole
        return Judgement(rain.astype(np.float32), rain, scan.valid, scan, frame, known)
