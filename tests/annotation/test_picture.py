"""The picture shows every judged point in the colour of its class, and the scene."""

import warnings

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgba

from derain.annotation.picture import CLASS_COLOURS, SURROUNDINGS, UNKNOWN_COLOUR, annotation_figure
from derain.annotation.scene import Box, Scene
from derain.evaluation.hard_cases import hard_cases, scene
from derain.fusion import UNKNOWN
from derain.scan import Scan
from derain.simulation.classes import TrackClass

SCENE = Scene(
    road=((2, -4), (60, -4), (60, 4), (2, 4)),
    boxes={"car": Box(TrackClass.CAR, (20, 0, -1), (4, 2, 1))},
    rain_area=((0, -9), (60, -9), (60, 9), (0, 9)),
)


def test_both_panels_and_the_legend_show_every_class_and_valid_point() -> None:
    points = scene(900)
    points[5] = np.nan
    points[6, :3] = 0  # no return
    scan, label = Scan.of(points), np.resize([*TrackClass, UNKNOWN], 900)
    figure = annotation_figure(scan, label, SCENE, "a scan")
    for panel in figure.axes:
        (dots,) = panel.collections
        shown = dots.get_facecolors()
        for kind in (*TrackClass, UNKNOWN):
            colour = CLASS_COLOURS.get(kind, UNKNOWN_COLOUR)
            count = np.isclose(shown, to_rgba(colour)).all(axis=1).sum()
            assert count == (label == kind)[scan.valid].sum()
    outlines = [patch.get_edgecolor() for patch in figure.axes[0].patches]
    colours = ["white", CLASS_COLOURS[TrackClass.RAIN], CLASS_COLOURS[TrackClass.CAR]]
    assert outlines == [to_rgba(colour) for colour in colours]
    FigureCanvasAgg(figure).draw()
    (legend,) = figure.legends
    assert len(legend.get_texts()) == len(TrackClass) + 1
    box = legend.get_window_extent()
    assert not any(box.overlaps(panel.get_tightbbox()) for panel in figure.axes)
    assert figure.bbox.containsx(box.x0)
    assert figure.bbox.containsx(box.x1)


@pytest.mark.parametrize("turned", [False, True], ids=["long road", "wide road"])
def test_a_metre_is_as_long_in_both_directions_from_above(turned: bool) -> None:
    road = [(y, x) if turned else (x, y) for x, y in SCENE.road]
    figure = annotation_figure(
        Scan.of(scene(300)), np.full(300, TrackClass.ROAD), Scene(tuple(road)), "a road"
    )
    figure.draw_without_rendering()
    above = figure.axes[0]
    metres = above.transData.transform([(0, 0), (1, 0), (0, 1)])
    assert metres[1, 0] - metres[0, 0] == pytest.approx(metres[2, 1] - metres[0, 1])
    low, high = np.transpose([above.get_xlim(), above.get_ylim()])
    assert low == pytest.approx(np.min(road, axis=0) - SURROUNDINGS)
    assert high == pytest.approx(np.max(road, axis=0) + SURROUNDINGS)


@pytest.mark.parametrize(
    ("name", "scan"),
    [case for case in hard_cases(100) if case[0] in ("nothing valid", "no intensity")],
)
def test_a_hard_case_is_drawn_without_a_warning(name: str, scan: Scan) -> None:
    label = np.full(len(scan), UNKNOWN)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figure = annotation_figure(scan, label, Scene(SCENE.road), name)
        figure.draw_without_rendering()
    judged = np.count_nonzero(scan.valid)
    assert [len(panel.collections[0].get_offsets()) for panel in figure.axes] == [judged] * 2
    explained = [text.get_text() for text in figure.legends[0].get_texts()]
    assert explained == ([f"unknown {judged:,}"] if judged else [])
    # The road alone is outlined.
    assert [len(panel.patches) for panel in figure.axes] == [1, 0]
