"""The layout of a recording in the viewer: scans side by side by method, range image, curves."""

from collections.abc import Mapping, Sequence

import rerun
import rerun.blueprint as views
from rerun.blueprint import Blueprint

from derain.pictures import entities, palette
from derain.pictures.entities import MethodEntities
from derain.pictures.palette import rgb
from derain.pictures.recording_file import RecordingFile
from derain.pictures.selection import Labels
from derain.sources.method import Method

# Where the viewer's eye is, and the point that it looks at, metres: from behind and above.
EYE, LOOK_TARGET = (-22.0, 0.0, 16.0), (6.0, 0.0, 0.0)

# Sizes of points on the screen, which Rerun takes as negative numbers. A method's points are drawn
# over those of the scan, and have to cover them.
SMALL, LARGE = -1.2, -2.4


def layout(methods: Mapping[str, Method], labels: Labels | None, placed: bool) -> Blueprint:
    """Views and panels that the viewer opens with.

    Args:
        methods: The methods by their titles.
        labels: Labels of the scans, where they have some.
        placed: True if the sensor's poses are known.
    """
    return Blueprint(
        views.Vertical(
            _clouds(methods, labels, placed),
            views.Spatial2DView(
                origin=entities.RANGES, name="Range image", background=rgb(palette.BACKGROUND)
            ),
            views.Horizontal(
                views.TimeSeriesView(origin=entities.SHARE, name="Share of the points, %"),
                views.TextDocumentView(origin=entities.CAPTION, name="Scan"),
                column_shares=[3, 1],
            ),
            row_shares=[5.5, 1.3, 2.6],
        ),
        # It stays at the first scan until somebody presses play.
        views.TimePanel(
            timeline=entities.FRAME, state="collapsed", fps=10, play_state="paused", loop_mode="all"
        ),
        views.SelectionPanel(state="hidden"),
        views.BlueprintPanel(state="hidden"),
        auto_views=False,
        auto_layout=False,
    )


def _clouds(methods: Mapping[str, Method], labels: Labels | None, placed: bool) -> views.Tabs:
    """The point clouds: tabs of what is removed and what is probable, the methods side by side."""
    scan = [entities.POINTS] if labels is None else [entities.POINTS, labels.points]
    first = "scan" if labels is None else f"scan and {labels.name}"
    places = {title: MethodEntities(title) for title in methods}
    removed = [_cloud(title, [m.kept, m.removed], placed) for title, m in places.items()]
    probability = [
        _cloud(f"{title}: probability", [entities.POINTS, m.probability], placed, dark=True)
        for title, m in places.items()
        if methods[title].gives_probabilities
    ]
    tabs = {"Removed": removed, "Probability": probability}
    return views.Tabs(
        *(
            views.Horizontal(_cloud(first, scan, placed), *of_methods, name=name)
            for name, of_methods in tabs.items()
            if of_methods
        ),
        active_tab=0,
    )


def _cloud(
    name: str, paths: Sequence[str], placed: bool, *, dark: bool = False
) -> views.Spatial3DView:
    # Bright points would look like probable rain, so all have the shade of probability 0.
    shade = rerun.Points3D.from_fields(colors=rgb(palette.PROBABILITY[0]))
    return views.Spatial3DView(
        origin="/",
        contents=[f"+ {path}" for path in paths],
        name=name,
        background=rgb(palette.BACKGROUND),
        overrides={entities.POINTS: shade} if dark else None,
        eye_controls=views.EyeControls3D(
            kind=views.Eye3DKind.Orbital,
            position=EYE,
            look_target=LOOK_TARGET,
            eye_up=(0, 0, 1),
            tracking_entity=entities.SENSOR if placed else None,
        ),
    )


def write_static(file: RecordingFile, labels: Labels | None, methods: Mapping[str, Method]) -> None:
    """Writes what holds for the whole recording: colours, sizes, names.

    Args:
        file: The file to write to.
        labels: Labels of the scans, where they have some.
        methods: The methods by their titles.
    """
    file.log("/", rerun.ViewCoordinates.FLU, entities.classes(), static=True)
    _sized(file, SMALL, [entities.POINTS])
    if labels is not None:
        _sized(file, LARGE, [labels.points])
        _line(file, labels.share, labels.name, palette.SOLID)
    for number, title in enumerate(methods):
        place = MethodEntities(title)
        _sized(file, SMALL, [place.kept])
        _sized(file, LARGE, [place.removed, place.probability])
        _line(file, place.share, title, palette.LINES[number % len(palette.LINES)])


def _sized(file: RecordingFile, size: float, paths: Sequence[str]) -> None:
    # Where points are few, the viewer would otherwise write their class over them.
    look = rerun.Points3D.from_fields(radii=size, show_labels=False)
    for path in paths:
        file.log(path, look, static=True)


def _line(file: RecordingFile, entity: str, name: str, colour: str) -> None:
    file.log(entity, rerun.SeriesLines(colors=rgb(colour), names=name, widths=2), static=True)
