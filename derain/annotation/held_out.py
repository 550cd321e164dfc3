"""Chooses the held-out scans, on which a student is compared with its teacher."""

from collections.abc import Iterator, Sequence
from itertools import repeat

from derain.annotation.manifest import HELD_OUT_PART, TRAINING_PART, TaughtPart
from derain.sources.frame import Frame

# One scan in ONE_IN is held out, and at least one of a sequence of FEWEST_SCANS or more.
ONE_IN, FEWEST_SCANS = 5, 3


def parts_of(frames: Sequence[Frame]) -> Iterator[TaughtPart]:
    """The part of each frame: the end of each sequence is held out.

    Neighbouring scans show nearly the same: a held-out scan between two training scans would not
    be new to the student.

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
    """Whether a frame is later in the same sequence; two sequences may have one name."""
    return frame.sequence == other.sequence and frame.number > other.number


def _parts(scans: int) -> list[TaughtPart]:
    held_out = max(scans // ONE_IN, 1) if scans >= FEWEST_SCANS else 0
    return [*repeat(TRAINING_PART, scans - held_out), *repeat(HELD_OUT_PART, held_out)]
