"""Frames by the recordings that they are of, and whether these are fit to be seen several at once.

Most methods see one scan at a time and need none of this; the alarm of the weather does.
"""

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise

from derain.errors import InputError
from derain.files.names import scan_stem
from derain.sources.file_frame import FileFrame
from derain.sources.frame import Frame
from derain.views.window import Window

# Seconds. Scans come ten or twenty times in one; after more than one, a car has gone so far that a
# scan shows little of the place of another's points.
LONGEST_STEP = 1.0

# The same where the numbers of files stand for times, as a multiple of their smallest step: a
# second at ten scans a second.
LONGEST_NUMBER_STEP = 10


def recordings_of(frames: Iterable[Frame]) -> list[list[Frame]]:
    """Frames in groups, in each of which every frame follows the one before it."""
    recordings: list[list[Frame]] = []
    for frame in frames:
        if not (recordings and frame.follows(recordings[-1][-1])):
            recordings.append([])
        recordings[-1].append(frame)
    return recordings


def unbroken_recordings(frames: Iterable[Frame]) -> list[list[Frame]]:
    """Scans in groups, in each of which every scan was taken soon after the one before it.

    Times decide, or else the names of files, where all of a folder are numbers: these rise, and no
    step is more than ten times the smallest one. Scans with neither are in no group, nor is one
    alone.

    Args:
        frames: Frames in time order, one recording after the other.

    Returns:
        The groups, of two scans or more each.
    """
    groups = [group for recording in recordings_of(frames) for group in _unbroken(recording)]
    return [group for group in groups if len(group) > 1]


def irregularities(frames: Iterable[Frame], window: Window) -> Iterator[str]:
    """What of recordings does not suit a method that sees several scans, a sentence each.

    Args:
        frames: Frames in time order, one recording after the other.
        window: How many scans the method needs. For one alone, everything suits, and nothing is
            read.
    """
    if window.is_one_scan:
        return
    recordings = recordings_of(frames)
    short = [each for each in recordings if len(each) <= window.before + window.after]
    if short:
        others = f" ({len(short):,} recordings are as short)" if len(short) > 1 else ""
        yield (
            f"{short[0][0].name}: {_scans(len(short[0]))} in its recording{others}, where each is "
            f"judged by {window.before} before and {window.after} after it: without them less is "
            "known"
        )
    for recording in recordings:
        yield from _of_steps(recording)


def _unbroken(recording: Sequence[Frame]) -> list[list[Frame]]:
    """A recording in the parts that breaks in time divide it into."""
    try:
        times = [frame.time for frame in recording]
    except InputError:
        times = [None] * len(recording)
    steps = [step for step in _steps(recording, times) if step is not None]
    if len(steps) + 1 < len(recording):
        return []
    smallest = min((step for step in steps if step > 0), default=0.0)
    longest = LONGEST_NUMBER_STEP * smallest if times[0] is None else LONGEST_STEP
    parts = [[recording[0]]]
    for frame, step in zip(recording[1:], steps, strict=True):
        if not 0 < step <= longest:
            parts.append([])
        parts[-1].append(frame)
    return parts


def _of_steps(recording: Sequence[Frame]) -> Iterator[str]:
    """What of the steps from scan to scan does not suit: the first of each kind."""
    try:
        times = [frame.time for frame in recording]
    except InputError as error:  # the method may well do without
        yield f"{recording[0].name}: when it was taken is not known: {error}"
        return
    steps = list(zip(recording[1:], _steps(recording, times), strict=True))
    backwards = [frame for frame, step in steps if step is not None and step <= 0]
    if backwards:
        yield (
            f"{backwards[0].name}: not later than the scan before it ({_scans(len(backwards))} in "
            "all): name them in the order that they were taken in"
        )
    apart = [frame for frame, step in steps if step is not None and step > LONGEST_STEP]
    if apart and times[0] is not None:
        yield (
            f"{apart[0].name}: more than {LONGEST_STEP:g} s after the scan before it "
            f"({_scans(len(apart))} in all): they say little of one another"
        )


def _steps(recording: Sequence[Frame], times: Sequence[float | None]) -> list[float | None]:
    """How far each frame but the first is from the one before it, as :func:`_step` gives it."""
    return [
        _step(before, after, *seconds)
        for (before, after), seconds in zip(pairwise(recording), pairwise(times), strict=True)
    ]


def _step(before: Frame, after: Frame, first: float | None, second: float | None) -> float | None:
    """How far on a frame is from the one before it: seconds, or numbers in the names of files."""
    if first is not None and second is not None:
        return second - first
    names = [scan_stem(f.path) for f in (before, after) if isinstance(f, FileFrame)]
    if len(names) == 2 and all(name.isascii() and name.isdigit() for name in names):
        return float(int(names[1]) - int(names[0]))
    return None


def _scans(number: int) -> str:
    return f"{number:,} scan{'' if number == 1 else 's'}"
