"""The units that a source splits into: recordings, bags, or blocks of scans of long recordings."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from hashlib import sha256

from derain.errors import InputError
from derain.jobs.shard import Shard
from derain.jobs.unit import Unit
from derain.sources.bag_frame import BagFrame
from derain.sources.frame import Frame
from derain.sources.method import Method
from derain.sources.recordings import recordings_of
from derain.sources.stored_frame import StoredBag
from derain.views.window import Window

# Scans of a block: a few seconds of a drive, beside which the scans around a block that are read
# once more take little.
BLOCK = 50


@dataclass(frozen=True)
class Division:
    """How a source is divided into units.

    Attributes:
        block: Scans of a block of a long recording.
        shard: The share of the units that is done; None for all.
        resume: Whether a record is kept even where there is only one unit.
        anew: Whether everything is done again, whatever the records of the folder are of.
    """

    block: int = BLOCK
    shard: Shard | None = None
    resume: bool = False
    anew: bool = False


@dataclass(frozen=True, eq=False, kw_only=True)
class FrameUnit(Unit):
    """Frames that are judged together, of one recording.

    Attributes:
        frames: Those that are judged, in time order.
        before: Those before them that the method sees.
        after: Those after them that it sees.
    """

    frames: tuple[Frame, ...]
    before: tuple[Frame, ...] = ()
    after: tuple[Frame, ...] = ()


def units_of(source: Sequence[Frame], method: Method, block: int = BLOCK) -> list[FrameUnit]:
    """Splits a source so that the method judges each unit as it would judge the whole source.

    A bag is one unit, for it is written as a whole, and so is a recording of which every scan may
    depend on all others. Other recordings are split into blocks of scans.

    Args:
        source: Frames in time order, one recording after the other.
        method: What judges them.
        block: Scans of a block.

    Returns:
        The units, in the order of the source. A unit has the key of its first frame for an id, and
        the name of the bag where it is one.
    """
    return [_unit(*span) for span in spans_of(source, method, block)]


def whole(source: Sequence[Frame]) -> FrameUnit:
    """All frames of a source as one unit, of which no record is kept."""
    return FrameUnit(id="", size=0, inputs="", frames=tuple(source))


# Frames of a recording, where a unit of it begins and ends, and what the method sees around it.
Span = tuple[Sequence[Frame], int, int, Window]


def spans_of(source: Sequence[Frame], method: Method, block: int) -> list[Span]:
    """Where the units of a source begin and end; arguments as for :func:`units_of`."""
    return [span for each in recordings_of(source) for span in _spans_of(each, method, block)]


def _spans_of(recording: Sequence[Frame], method: Method, block: int) -> Iterator[Span]:
    window = (
        None if isinstance(recording[0], BagFrame | StoredBag) else method.depends_on(recording)
    )
    if window is None:
        window, block = Window(), len(recording)
    for begin in range(0, len(recording), block):
        yield recording, begin, begin + block, window


def _unit(recording: Sequence[Frame], begin: int, end: int, window: Window) -> FrameUnit:
    frames = tuple(recording[begin:end])
    before = tuple(recording[max(begin - window.before, 0) : begin])
    after = tuple(recording[end : end + window.after])
    seen = (*before, *frames, *after)
    return FrameUnit(
        id=frames[0].sequence if isinstance(frames[0], BagFrame) else frames[0].key,
        size=sum(map(_size, frames)),
        inputs=sha256("\n".join(map(_stamp, seen)).encode()).hexdigest()[:16],
        frames=frames,
        before=before,
        after=after,
    )


def _size(frame: Frame) -> int:
    try:
        return frame.size()
    except InputError:  # reported when the frame is read
        return 0


def _stamp(frame: Frame) -> str:
    """The frame's name in its recording, and what changes when its file does."""
    try:
        return f"{frame.key} {frame.stamp()}"
    except InputError:
        return frame.key
