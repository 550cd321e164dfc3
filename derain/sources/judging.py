"""Gives whole recordings to a method, frame after frame, and yields its answers."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path

from derain.errors import InputError
from derain.files.reading import reading
from derain.sources.frame import Frame
from derain.sources.judgement import Judgement
from derain.sources.method import Method
from derain.system.stopwatch import Stopwatch

# Surrounds the work on a frame, so that one that fails can be reported and passed over.
Guard = Callable[[Frame], AbstractContextManager[None]]


# A frame, its judgement, and the times of the stages since the answer before.
Answer = tuple[Frame, Judgement, Stopwatch]


def unguarded(frame: Frame) -> AbstractContextManager[None]:
    """Lets whatever is wrong with a frame end the whole work."""
    return nullcontext()


class Failures:
    """Holds back what is wrong with single frames, so that the others go on.

    Args:
        report: Called with each error.

    Attributes:
        errors: The errors so far.
    """

    def __init__(self, report: Callable[[InputError], None]) -> None:
        self.errors: list[InputError] = []
        self._report = report

    @contextmanager
    def skipping_failures(self, frame: Frame) -> Iterator[None]:
        """Reports and keeps the error of the block.

        Args:
            frame: What the block works on.
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
        guard: Surrounds the work on each; where it holds an error back, the frame has no answer.

    Yields:
        Each frame with its judgement, in the order of the frames.

    Raises:
        InputError: A frame that cannot be read or judged, where the guard lets that through.
    """
    last = None
    for frame in frames:
        if last is not None and method.starts_new_recording(frame):
            yield from _flushed(method, last, guard)
        last, judgement, stopwatch = frame, None, Stopwatch()
        with guard(frame):
            judgement = method.push(frame, stopwatch)
        if judgement is not None:
            yield _frame_of(judgement), judgement, stopwatch
    if last is not None:
        yield from _flushed(method, last, guard)


def _flushed(method: Method, last: Frame, guard: Guard) -> Iterator[Answer]:
    """The answers for the frames that wait, after the last of a recording was pushed."""
    while method.waiting:  # where one fails, the others go on waiting
        with guard(last):
            stopwatch = Stopwatch()
            for judgement in method.flush(stopwatch):
                yield _frame_of(judgement), judgement, stopwatch
                stopwatch.milliseconds.clear()


def _frame_of(judgement: Judgement) -> Frame:
    assert judgement.frame is not None  # a frame was pushed, not points
    return judgement.frame
