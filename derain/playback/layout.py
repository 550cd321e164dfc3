"""How the viewer opens a recording: scans side by side by method, range images, shares."""

from collections.abc import Sequence

import rerun.blueprint as views
from rerun.blueprint import Blueprint

from derain.pictures.palette import BACKGROUND, rgb
from derain.playback.entities import (
    CAPTION,
    FRAME,
    POINTS,
    RANGE_IMAGE,
    RANGES,
    SENSOR,
    SHARE,
    TRAJECTORY,
    OfMethod,
)
from derain.playback.labels import Labels

# From where a scan is looked at, and where to, metres: from behind and above.
STANDPOINT, LOOKED_AT = (-22.0, 0.0, 16.0), (6.0, 0.0, 0.0)


def layout(titles: Sequence[str], labels: Labels | None, placed: bool) -> Blueprint:
    """The layout.

    Args:
        titles: What the methods are called.
        labels: Labels that lie with the scans.
        placed: Whether the sensor's poses are known.
    """
    methods = {title: OfMethod(title) for title in titles}
    scan = [POINTS] if labels is None else [POINTS, labels.stand_at.points]
    first = "scan" if labels is None else f"scan and {labels.name}"
    return Blueprint(
        views.Vertical(
            views.Tabs(
                _side_by_side(
                    "Removed",
                    {first: scan} | {title: [m.kept, m.removed] for title, m in methods.items()},
                    placed,
                ),
                _side_by_side(
                    "Cleaned",
                    {first: scan} | {f"{title}: kept": [m.kept] for title, m in methods.items()},
                    placed,
                ),
                _side_by_side(
                    "Probability",
                    {first: scan}
                    | {f"{t}: probability": [POINTS, m.probability] for t, m in methods.items()},
                    placed,
                ),
                active_tab=0,
            ),
            views.Tabs(
                *(
                    _image(f"{title}: range image", [RANGES, method.image])
                    for title, method in methods.items()
                ),
                _image("range image", [RANGES]),
                active_tab=0,
            ),
            views.Horizontal(
                views.TimeSeriesView(origin=SHARE, name="Share of the points, %"),
                views.TextDocumentView(origin=CAPTION, name="Scan"),
                column_shares=[3, 1],
            ),
            row_shares=[5.5, 1.3, 2.6],
        ),
        views.TimePanel(timeline=FRAME, state="collapsed", fps=10),
        views.SelectionPanel(state="hidden"),
        views.BlueprintPanel(state="hidden"),
        auto_views=False,
        auto_layout=False,
    )


def _side_by_side(name: str, shown: dict[str, list[str]], placed: bool) -> views.Horizontal:
    return views.Horizontal(
        *(_cloud(title, paths, placed) for title, paths in shown.items()), name=name
    )


def _cloud(name: str, paths: Sequence[str], placed: bool) -> views.Spatial3DView:
    return views.Spatial3DView(
        origin="/",
        contents=[f"+ {path}" for path in (*paths, TRAJECTORY)],
        name=name,
        background=rgb(BACKGROUND),
        eye_controls=views.EyeControls3D(
            kind=views.Eye3DKind.Orbital,
            position=STANDPOINT,
            look_target=LOOKED_AT,
            eye_up=(0, 0, 1),
            tracking_entity=SENSOR if placed else None,
        ),
    )


def _image(name: str, paths: Sequence[str]) -> views.Spatial2DView:
    return views.Spatial2DView(
        origin=RANGE_IMAGE,
        contents=[f"+ {path}" for path in paths],
        name=name,
        background=rgb(BACKGROUND),
    )
