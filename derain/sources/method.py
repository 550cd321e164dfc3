"""The base classes of methods, which judge the frames of a recording, or each scan by itself."""

import json
import sys
import warnings
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from hashlib import sha256
from typing import Any, ClassVar

from derain.errors import ScanWarning
from derain.scan import Array, Scan
from derain.sources.frame import Frame
from derain.sources.judgement import Judgement
from derain.sources.window import Window
from derain.system.stopwatch import Stopwatch
from derain.views.scan_issues import ScanIssue, much_removed


class Method(ABC):
    """Finds the points of rain in a recording: a model, a filter, or a method of several scans.

    Frames go in by :meth:`push`, one after the other. A method that sees one scan at a time answers
    at once; one that needs scans after the one that it judges answers when they are there, and for
    the last ones by :meth:`flush`. So a recording is cleaned in the same way by each::

        for frame in source:
            if method.starts_new_recording(frame):
                answers += method.flush()
            answers += filter(None, [method.push(frame)])
        answers += method.flush()

    :func:`derain.sources.judging.judgements` does it.

    Attributes:
        EXAMINE_EVERY: One scan in this number is examined for :meth:`issues`.
        warns: True to warn of issues, by :class:`~derain.errors.ScanWarning`. Callers that print
            the issues themselves set it to False.
    """

    # The first scan is examined, and then one in this number. It takes 3 to 7 milliseconds for
    # 116,000 points, a tenth of a filter's time; the scans of one sensor mostly have one fault.
    EXAMINE_EVERY: ClassVar[int] = 100

    warns: bool = True
    _scans_checked: int = 0

    @property
    def window(self) -> Window:
        """Scans that it needs before and after the one that it judges; none by default."""
        return Window()

    @property
    def gives_probabilities(self) -> bool:
        """True if it gives the probability of rain, and not only which points are rain."""
        return True

    @property
    def waiting(self) -> int:
        """Number of frames that were pushed and not answered: none, if it sees one at a time."""
        return 0

    def starts_new_recording(self, frame: Frame) -> bool:
        """True if pushing a frame would drop those that wait, because it does not follow them."""
        return False

    @abstractmethod
    def push(
        self, frame: Frame | Scan | Array, stopwatch: Stopwatch | None = None
    ) -> Judgement | None:
        """Takes the next frame of a recording.

        A frame of another sequence, or after a gap, starts a new recording: call :meth:`flush`
        before it, or the frames that still wait are dropped.

        Args:
            frame: A frame, which is read; or a Scan, or (N, ≥ 3) numbers: x, y, z in metres in the
                sensor's frame, then intensity; each of these is taken for the next of one sequence.
            stopwatch: Takes the times of the stages, such as read, view, network and back.

        Returns:
            The judgement of the frame whose window is now complete; None until there is
            one.

        Raises:
            InputError: A frame that cannot be read or judged.
        """

    def flush(self, stopwatch: Stopwatch | None = None) -> Iterator[Judgement]:
        """Ends a recording: answers for the frames that still wait, with the scans that there are.

        Frames pushed afterwards belong to another recording. If a waiting frame cannot be judged,
        the frames after it keep waiting.

        Args:
            stopwatch: Takes the times of the stages.

        Raises:
            InputError: A frame that cannot be judged.
        """
        return iter(())

    @abstractmethod
    def issues(self, judgement: Judgement) -> Iterator[ScanIssue]:
        """Warnings about a scan that it judged, as far as that matters to the method.

        Args:
            judgement: Its judgement of the scan.
        """

    def with_warnings(self, judgement: Judgement) -> Judgement:
        """Returns a judgement, and warns of each kind of issue that no scan had before."""
        if not self.warns:
            return judgement
        issues = [*much_removed(judgement.share_of_rain)]
        if self._scans_checked % self.EXAMINE_EVERY == 0:
            issues += self.issues(judgement)
        self._scans_checked += 1
        for issue in issues:
            if issue.kind not in self._warned_of:
                self._warned_of.add(issue.kind)
                text = f"{judgement.scan.name}: {issue.detail}"
                warnings.warn(text, ScanWarning, stacklevel=_stack_level_of_caller())
        return judgement

    @cached_property
    def _warned_of(self) -> set[str]:
        """Kinds of faults."""
        return set()

    def depends_on(self, recording: Sequence[Frame]) -> Window | None:
        """Number of scans around one on which its answer depends.

        Args:
            recording: Frames; each follows the one before it.

        Returns:
            Numbers of scans before and after; None if it may depend on all of them, as here.
        """
        return None

    def fingerprint(self) -> str:
        """A fingerprint of its answers: of its parameters, and of its weights if it has any.

        It is 16 hexadecimal digits.
        """
        return sha256(json.dumps(self.as_dict(), sort_keys=True).encode()).hexdigest()[:16]

    @abstractmethod
    def as_dict(self) -> dict[str, Any]:
        """The settings to make it again: ``method``, its name, and its parameters.

        Texts, finite numbers, true, false, or nothing; or lists and mappings of these.
        """


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


def _stack_level_of_caller() -> int:
    """The level of the stack, as warnings.warn counts from who calls this, outside derain."""
    level, frame = 1, sys._getframe(1)
    while frame.f_back and frame.f_globals.get("__name__", "").startswith("derain."):
        level, frame = level + 1, frame.f_back
    return level
