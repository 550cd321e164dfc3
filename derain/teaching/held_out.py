"""Which scans of a recording are held out, to see how well a student agrees with its teacher."""

from collections.abc import Iterator, Sequence
from itertools import repeat

from derain.sources.frame import Frame
from derain.teaching.manifest import HELD_OUT_PART, TRAINING_PART, TaughtPart

# One scan in so many is held out, and one at least of a recording of so many scans.
ONE_IN, FEWEST_SCANS = 5, 3


def parts_of(frames: Sequence[Frame]) -> Iterator[TaughtPart]:
    """What each frame is for: a stretch at the end of each sequence is held out.

    Neighbouring scans show nearly the same: one that is held out between two of the training would
    be known by heart.

    Args:
        frames: Frames in time order, one sequence after the other, perhaps with some missing.
    """
    sequence: list[Frame] = []
    for frame in frames:
        if sequence and not _is_later(frame, sequence[-1]):
            yield from _parts(len(sequence))
            sequence = []
        sequence.append(frame)
    yield from _parts(len(sequence))


def _is_later(frame: Frame, other: Frame) -> bool:
    """Whether a frame comes later in the same sequence; two folders may be called the same."""
    return frame.sequence == other.sequence and frame.number > other.number


def _parts(scans: int) -> list[TaughtPart]:
    held_out = max(scans // ONE_IN, 1) if scans >= FEWEST_SCANS else 0
    return [*repeat(TRAINING_PART, scans - held_out), *repeat(HELD_OUT_PART, held_out)]
