"""The scans around one in its sequence, for views that ask for more than the one."""

from collections.abc import Callable, Sequence

from derain.scan import Scan
from derain.sources.frame import Frame
from derain.views.view import SeenScan, View
from derain.views.window import PlacedScan, WindowOfScans


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
    first = max(number - window.before, 0)
    before, after = frames[first:number], frames[number + 1 : number + 1 + window.after]
    own = frames[number]

    def placed(frame: Frame, scan: Scan) -> PlacedScan:
        return PlacedScan(scan, frame.time, frame.pose)

    def of_sequence(around: Sequence[Frame]) -> list[PlacedScan]:
        return [placed(frame, read(frame)) for frame in around if frame.sequence == own.sequence]

    return view.of_window(WindowOfScans(placed(own, scan), of_sequence(before), of_sequence(after)))
