"""What holds for the whole of a recording to look at: colours, sizes, names, the sensor's way."""

from collections.abc import Mapping, Sequence

import rerun

from derain.pictures.palette import LINES, MISSED, SOLID, rgb
from derain.playback.entities import POINTS, TRAJECTORY, OfMethod, classes
from derain.playback.labels import Labels
from derain.playback.recording_file import RecordingFile
from derain.playback.selection import Selection
from derain.sources.method import Method

# Sizes of points, in points of the screen, which Rerun writes as numbers below 0. What was found
# lies over the same points of the scan, and has to cover them.
SMALL, LARGE = -1.2, -2.4


def write_what_lasts(
    file: RecordingFile, selection: Selection, labels: Labels | None, methods: Mapping[str, Method]
) -> None:
    """Writes it.

    Args:
        file: Where to.
        selection: What is shown.
        labels: Labels that lie with the scans.
        methods: The methods by their titles.
    """
    file.log("/", rerun.ViewCoordinates.FLU, classes(), static=True)
    _sized(file, SMALL, [POINTS])
    if selection.ways:
        way = rerun.LineStrips3D(selection.ways, colors=rgb(SOLID), radii=LARGE)
        file.log(TRAJECTORY, way, static=True)
    if labels is not None:
        stand_at = labels.stand_at
        _sized(file, LARGE, [stand_at.points])
        _line(file, stand_at.share, labels.name, SOLID)
        _line(file, stand_at.share_not_known, f"not known to the {labels.name}", MISSED)
    for place, title in enumerate(methods):
        of_method = OfMethod(title)
        _sized(file, SMALL, [of_method.kept])
        _sized(file, LARGE, [of_method.removed, of_method.missed, of_method.probability])
        for line in (of_method.share, of_method.iou):
            _line(file, line, title, LINES[place % len(LINES)])


def _sized(file: RecordingFile, size: float, paths: Sequence[str]) -> None:
    # Where points are few, the viewer would write over them what they are classed as.
    look = rerun.Points3D.from_fields(radii=size, show_labels=False)
    for path in paths:
        file.log(path, look, static=True)


def _line(file: RecordingFile, path: str, name: str, colour: str) -> None:
    file.log(path, rerun.SeriesLines(colors=rgb(colour), names=name, widths=2), static=True)
