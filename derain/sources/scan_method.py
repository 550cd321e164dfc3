"""The base class of methods that judge each scan by itself."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import replace

from derain.scan import Array, Scan
from derain.sources.frame import Frame
from derain.sources.judgement import Judgement
from derain.sources.method import Method
from derain.sources.window import Window
from derain.system.stopwatch import Stopwatch


class ScanMethod(Method):
    """A method that sees one scan at a time, and answers for it at once: a model or a filter."""

    @abstractmethod
    def judge(self, points: Scan | Array, stopwatch: Stopwatch | None = None) -> Judgement:
        """Judges a scan.

        Args:
            points: A Scan, or numbers of which the first columns are x, y, z in metres in the
                sensor's frame, then intensity.
            stopwatch: Takes the times of the stages view, network and back.
        """

    def depends_on(self, recording: Sequence[Frame]) -> Window:
        """No scans but the one that it judges."""
        return self.window

    def push(self, frame: Frame | Scan | Array, stopwatch: Stopwatch | None = None) -> Judgement:
        """Judges the next frame of a recording, at once.

        Args:
            frame: A frame, which is read; or points, as for :meth:`judge`.
            stopwatch: Takes the times of the stages read, view, network and back.

        Raises:
            InputError: A frame that cannot be read or judged.
        """
        stopwatch = stopwatch or Stopwatch()
        if not isinstance(frame, Frame):
            return self.judge(frame, stopwatch)
        with stopwatch.stage("read"):
            scan = frame.read()
        return replace(self.judge(scan, stopwatch), frame=frame)
