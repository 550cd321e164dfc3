"""How the viewer opens a recording: scans side by side by method, range images, curves."""

from collections.abc import Mapping, Sequence

import rerun
import rerun.blueprint as views
from rerun.blueprint import Blueprint

from derain.pictures.palette import BACKGROUND, PROBABILITY, rgb
from derain.playback.entities import (
    CAPTION,
    FRAME,
    IOU,
    POINTS,
    RANGE_IMAGE,
    RANGES,
    SENSOR,
    SHARE,
    TRAJECTORY,
    OfMethod,
)
from derain.playback.labels import Labels
from derain.sources.method import Method

# From where a scan is looked at, and where to, metres: from behind and above.
STANDPOINT, LOOKED_AT = (-22.0, 0.0, 16.0), (6.0, 0.0, 0.0)


def layout(methods: Mapping[str, Method], labels: Labels | None, placed: bool) -> Blueprint:
    """The layout.

    Args:
        methods: The methods by their titles.
        labels: Labels that lie with the scans.
        placed: Whether the sensor's poses are known.
    """
    return Blueprint(
        views.Vertical(
            _clouds(methods, labels, placed),
            _images(methods),
            _curves(labels),
            row_shares=[5.5, 1.3, 2.6],
        ),
        # It stands at the first scan until somebody has it play.
        views.TimePanel(
            timeline=FRAME, state="collapsed", fps=10, play_state="paused", loop_mode="all"
        ),
        views.SelectionPanel(state="hidden"),
        views.BlueprintPanel(state="hidden"),
        auto_views=False,
        auto_layout=False,
    )


def _clouds(methods: Mapping[str, Method], labels: Labels | None, placed: bool) -> views.Tabs:
    """The scans in three dimensions: a tab for each thing to be seen, the methods side by side."""
    scan = [POINTS] if labels is None else [POINTS, labels.stand_at.points]
    first = "scan" if labels is None else f"scan and {labels.name}"
    stand_at = {title: OfMethod(title) for title in methods}
    removed = [
        _cloud(title, [m.kept, m.removed, m.missed], placed) for title, m in stand_at.items()
    ]
    cleaned = [
        _cloud(f"{title}: kept", [m.kept, m.missed], placed) for title, m in stand_at.items()
    ]
    probability = [
        _cloud(f"{title}: probability", [POINTS, m.probability], placed, dark=True)
        for title, m in stand_at.items()
        if methods[title].gives_probabilities
    ]
    tabs = {"Removed": removed, "Cleaned": cleaned, "Probability": probability}
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
    # Bright points of the scan would look like probable rain: there all are as what is improbable.
    shade = rerun.Points3D.from_fields(colors=rgb(PROBABILITY[0]))
    return views.Spatial3DView(
        origin="/",
        contents=[f"+ {path}" for path in (*paths, TRAJECTORY)],
        name=name,
        background=rgb(BACKGROUND),
        overrides={POINTS: shade} if dark else None,
        eye_controls=views.EyeControls3D(
            kind=views.Eye3DKind.Orbital,
            position=STANDPOINT,
            look_target=LOOKED_AT,
            eye_up=(0, 0, 1),
            tracking_entity=SENSOR if placed else None,
        ),
    )


def _images(methods: Mapping[str, Method]) -> views.Tabs:
    """The range image, and over it what each method finds."""
    return views.Tabs(
        *(_image(f"{title}: range image", [RANGES, OfMethod(title).image]) for title in methods),
        _image("range image", [RANGES]),
        active_tab=0,
    )


def _image(name: str, paths: Sequence[str]) -> views.Spatial2DView:
    return views.Spatial2DView(
        origin=RANGE_IMAGE,
        contents=[f"+ {path}" for path in paths],
        name=name,
        background=rgb(BACKGROUND),
    )


def _curves(labels: Labels | None) -> views.Horizontal:
    """What changes from scan to scan as numbers, and the text of the scan."""
    shares = _curve(SHARE, "Share of the points, %", legend=True)
    text = views.TextDocumentView(origin=CAPTION, name="Scan")
    if labels is None:
        return views.Horizontal(shares, text, column_shares=[3, 1])
    iou = _curve(IOU, f"IoU with the {labels.name}", legend=False)  # has the same colours
    return views.Horizontal(shares, iou, text, column_shares=[3, 3, 2])


def _curve(origin: str, name: str, *, legend: bool) -> views.TimeSeriesView:
    return views.TimeSeriesView(
        origin=origin, name=name, plot_legend=views.PlotLegend(visible=legend)
    )
