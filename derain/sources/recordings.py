"""Divides frames into recordings, and checks their order and spacing in time.

Methods that use several scans and the warnings of bad weather need this; most methods use one scan.
"""

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise

from derain.errors import InputError, counted
from derain.files.names import scan_stem
from derain.sources.file_frame import FileFrame
from derain.sources.frame import Frame, times_of
from derain.sources.window import Window

# Seconds. Sensors take ten or twenty scans per second. In more than one second, a car drives so far
# that two scans have few places in common.
LONGEST_STEP = 1.0

# The same limit for numbered files without times, in multiples of their smallest step: one second
# at ten scans per second.
LONGEST_NUMBER_STEP = 10


def recordings_of(frames: Iterable[Frame]) -> list[list[Frame]]:
    """Groups frames: in each group, every frame follows the one before it."""
    recordings: list[list[Frame]] = []
    for frame in frames:
        if not (recordings and frame.follows(recordings[-1][-1])):
            recordings.append([])
        recordings[-1].append(frame)
    return recordings


def unbroken_recordings(frames: Iterable[Frame]) -> list[list[Frame]]:
    """Groups scans: in each group, every scan was taken soon after the one before it.

    The times of the scans decide. Without times, file names decide if all of a folder are numbers:
    the numbers rise, and no step is more than ten times the smallest one. Scans with neither times
    nor numbers are in no group, and there are no groups of one scan.

    Args:
        frames: Frames in time order, one recording after the other.

    Returns:
        The groups, of two scans or more each.
    """
    groups = [group for recording in recordings_of(frames) for group in _unbroken(recording)]
    return [group for group in groups if len(group) > 1]


def irregularities(
    frames: Iterable[Frame], window: Window, *, needed: bool = True
) -> Iterator[str]:
    """Describes faults of recordings that harm a method that uses several scans.

    Args:
        frames: Frames in time order, one recording after the other.
        window: Scans that the method uses. If it uses one, there are no faults, and nothing is
            read.
        needed: False if it can judge a scan without the others. Recordings may then have breaks,
            but not times that are damaged or do not rise.

    Yields:
        One sentence for each fault.
    """
    if window.is_one_scan:
        return
    for recording in recordings_of(frames):
        yield from _irregular_steps(recording, needed)


def _unbroken(recording: Sequence[Frame]) -> list[list[Frame]]:
    """Divides a recording where there is a break in time."""
    try:
        times = times_of(recording)
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


def _irregular_steps(recording: Sequence[Frame], needed: bool) -> Iterator[str]:
    """Describes the first step in time of each kind that harms the method."""
    try:
        times = times_of(recording)
    except InputError as error:  # the method may not need times
        yield f"{recording[0].name}: its time is not known: {error}"
        return
    steps = _steps(times or _numbers(recording) or [])
    backwards = [frame for frame, step in zip(recording[1:], steps, strict=False) if step <= 0]
    if backwards:
        yield (
            f"{backwards[0].name}: not later than the scan before it "
            f"({counted(len(backwards), 'scan')} in all): name the scans in time order"
        )
    if not times or not needed:
        return
    apart = [frame for frame, step in zip(recording[1:], steps, strict=True) if step > LONGEST_STEP]
    if apart:
        yield (
            f"{apart[0].name}: more than {LONGEST_STEP:g} s after the scan before it "
            f"({counted(len(apart), 'scan')} in all): such scans have little in common"
        )


def _numbers(recording: Sequence[Frame]) -> list[int] | None:
    """Numbers that are the names of the files; None unless all names are numbers."""
    names = [scan_stem(frame.path) for frame in recording if isinstance(frame, FileFrame)]
    digits = [name for name in names if name.isascii() and name.isdigit()]
    return list(map(int, digits)) if len(digits) == len(recording) else None


def _steps(places: Sequence[float]) -> list[float]:
    """Difference of each place but the first to the one before it."""
    return [after - before for before, after in pairwise(places)]
