"""Gives whole recordings to a method, frame after frame, and yields its answers."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path

from derain.errors import InputError
from derain.files.reading import reading
from derain.sources.frame import Frame
from derain.sources.judgement import Judgement
from derain.sources.method import Method
from derain.sources.recent_frames import ScanError
from derain.system.stopwatch import Stopwatch

# Context manager around the work on a frame: it can report a failure, so that the others continue.
Guard = Callable[[Frame], AbstractContextManager[None]]

# A frame, its judgement, and the times of the stages since the answer before.
Answer = tuple[Frame, Judgement, Stopwatch]

# A frame's judgement, or its error.
AnswerOrError = tuple[Frame, Judgement | InputError, Stopwatch]


def unguarded(frame: Frame) -> AbstractContextManager[None]:
    """Lets any error of a frame end the whole work."""
    return nullcontext()


class Failures:
    """Collects the errors of single frames, so that the others continue.

    Args:
        report: Called with each error.

    Attributes:
        errors: The errors so far.
    """

    def __init__(self, report: Callable[[InputError], None] = lambda error: None) -> None:
        self.errors: list[InputError] = []
        self._report = report

    @contextmanager
    def skipping_failures(self, frame: Frame) -> Iterator[None]:
        """Reports and keeps the error of the block.

        Args:
            frame: Frame that the block works on.
        """
        try:
            with reading(Path(frame.name)):  # which names the file where the memory is full
                yield
        except InputError as error:
            self.errors.append(error)
            self._report(error)


def judgements(
    method: Method, frames: Iterable[Frame], guard: Guard = unguarded
) -> Iterator[Answer]:
    """Judges the frames of recordings.

    Args:
        method: The method.
        frames: Frames in time order, one sequence after the other.
        guard: Surrounds the error of each; where it holds the error back, the frame has no answer.

    Yields:
        Each frame with its judgement, in the order of the frames.

    Raises:
        InputError: A frame that cannot be read or judged, where the guard lets that through.
    """
    for frame, answer, stopwatch in answers(method, frames):
        if isinstance(answer, InputError):
            with guard(frame):
                raise answer
        else:
            yield frame, answer, stopwatch


def answers(method: Method, frames: Iterable[Frame]) -> Iterator[AnswerOrError]:
    """Judges the frames of recordings, and continues after frames that cannot be read or judged.

    Args:
        method: The method.
        frames: Frames in time order, one sequence after the other.

    Yields:
        Each frame as soon as it is judged, or has failed with an error.
    """
    last = None
    for frame in frames:
        if last is not None and method.starts_new_recording(frame):
            yield from _flushed(method, last)
        last, judgement, stopwatch = frame, None, Stopwatch()
        try:
            with reading(Path(frame.name)):  # which names the file where the memory is full
                judgement = method.push(frame, stopwatch)
        except InputError as error:
            yield _failed_frame(error, frame), error, stopwatch
        if judgement is not None:
            yield _frame_of(judgement), judgement, stopwatch
    if last is not None:
        yield from _flushed(method, last)


def _flushed(method: Method, last: Frame) -> Iterator[AnswerOrError]:
    """The answers for the frames that wait, after the last of a recording was pushed."""
    while method.waiting:  # if one fails, the others keep waiting
        stopwatch = Stopwatch()
        try:
            with reading(Path(last.name)):
                for judgement in method.flush(stopwatch):
                    yield _frame_of(judgement), judgement, stopwatch
                    stopwatch.milliseconds.clear()
        except InputError as error:
            yield _failed_frame(error, last), error, stopwatch


def _failed_frame(error: InputError, pushed: Frame) -> Frame:
    """The frame that caused an error: the one that was judged, or else the one pushed last."""
    return error.frame if isinstance(error, ScanError) else pushed


def _frame_of(judgement: Judgement) -> Frame:
    assert judgement.frame is not None  # a frame was pushed, not points
    return judgement.frame
