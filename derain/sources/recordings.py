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
        times = _times(recording)
    except InputError:
        times = None
    places = times or _numbers(recording)
    if places is None:
        return []
    steps = _steps(places)
    smallest = min((step for step in steps if step > 0), default=0)
    longest = LONGEST_STEP if times else LONGEST_NUMBER_STEP * smallest
    parts = [[recording[0]]]
    for frame, step in zip(recording[1:], steps, strict=True):
        if not 0 < step <= longest:
            parts.append([])
        parts[-1].append(frame)
    return parts


def _of_steps(recording: Sequence[Frame]) -> Iterator[str]:
    """What of the steps from scan to scan does not suit: the first of each kind."""
    try:
        times = _times(recording)
    except InputError as error:  # the method may well do without
        yield f"{recording[0].name}: when it was taken is not known: {error}"
        return
    steps = _steps(times or _numbers(recording) or [])
    backwards = [frame for frame, step in zip(recording[1:], steps, strict=False) if step <= 0]
    if backwards:
        yield (
            f"{backwards[0].name}: not later than the scan before it ({_scans(len(backwards))} in "
            "all): name them in the order that they were taken in"
        )
    if not times:
        return
    apart = [frame for frame, step in zip(recording[1:], steps, strict=True) if step > LONGEST_STEP]
    if apart:
        yield (
            f"{apart[0].name}: more than {LONGEST_STEP:g} s after the scan before it "
            f"({_scans(len(apart))} in all): they say little of one another"
        )


def _times(recording: Sequence[Frame]) -> list[float] | None:
    """When the scans were taken, seconds; None where that is not known of all."""
    times = [time for frame in recording if (time := frame.time) is not None]
    return times if len(times) == len(recording) else None


def _numbers(recording: Sequence[Frame]) -> list[int] | None:
    """The numbers that the files are named by; None where not all are."""
    names = [scan_stem(frame.path) for frame in recording if isinstance(frame, FileFrame)]
    digits = [name for name in names if name.isascii() and name.isdigit()]
    return list(map(int, digits)) if len(digits) == len(recording) else None


def _steps(places: Sequence[float]) -> list[float]:
    """How far each scan but the first is from the one before it."""
    return [after - before for before, after in pairwise(places)]


def _scans(number: int) -> str:
    return f"{number:,} scan{'' if number == 1 else 's'}"
