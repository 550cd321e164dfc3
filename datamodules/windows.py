"""The scans around one in its sequence, for views that ask for more than the one."""

from collections.abc import Callable, Sequence

from derain.scan import Scan
from derain.sources.frame import Frame
from derain.views.view import SeenScan, View
from derain.views.window import PlacedScan, Window, WindowOfScans


def seen(
    view: View,
    scan: Scan,
    frames: Sequence[Frame],
    number: int,
    read: Callable[[Frame], Scan],
) -> SeenScan:
    """What a network sees of a scan, among those around it where its view asks for them.

    Args:
        view: The view.
        scan: The scan that is to be judged, as it was read and perhaps changed.
        frames: All frames, in time order, one sequence after the other.
        number: Which of them the scan is of.
        read: Reads the scans around it.

    Raises:
        InputError: A scan around it, or its time or pose, that cannot be read.
    """
    window = view.window
    if window.is_one_scan:
        return view(scan)

    def placed(place: int) -> PlacedScan:
        frame = frames[place]
        return PlacedScan(scan if place == number else read(frame), frame.time, frame.pose)

    first, last = _reach(frames, number, window)
    before, after = range(first, number), range(number + 1, last + 1)
    return view.of_window(
        WindowOfScans(placed(number), [*map(placed, before)], [*map(placed, after)])
    )


def _reach(frames: Sequence[Frame], number: int, window: Window) -> tuple[int, int]:
    """The first and the last frame of a window, which reaches over no gap in a sequence."""
    first = last = number
    while first > max(number - window.before, 0) and frames[first].follows(frames[first - 1]):
        first -= 1
    end = min(number + window.after, len(frames) - 1)
    while last < end and frames[last + 1].follows(frames[last]):
        last += 1
    return first, last
