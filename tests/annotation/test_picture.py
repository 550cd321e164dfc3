"""The picture shows every judged point in the colour of its class, and the scene."""

import warnings

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba

from derain.annotation.picture import CLASS_COLOURS, annotation_figure
from derain.annotation.scene import Box, Scene
from derain.evaluation.hard_cases import scene
from derain.fusion import UNKNOWN
from derain.scan import Scan
from derain.simulation.classes import TrackClass

SCENE = Scene(
    road=((2, -4), (60, -4), (60, 4), (2, 4)),
    boxes={"car": Box(TrackClass.CAR, (20, 0, -1), (4, 2, 1))},
    rain_area=((0, -9), (60, -9), (60, 9), (0, 9)),
)


def dots(panel: Axes) -> dict[tuple[float, ...], int]:
    """Number of dots by their colour."""
    return {
        tuple(drawn.get_facecolors()[0].tolist()): len(drawn.get_offsets())
        for drawn in panel.collections
    }


def test_both_panels_and_the_legend_show_every_class_and_valid_point() -> None:
    points = scene(900)
    points[5] = np.nan
    points[6, :3] = 0  # no return
    scan, label = Scan.of(points), np.resize([*TrackClass, UNKNOWN], 900)
    figure = annotation_figure(scan, label, SCENE, "a scan")
    seen = label[scan.valid]
    expected = {to_rgba(colour): (seen == kind).sum() for kind, colour in CLASS_COLOURS.items()}
    assert [dots(panel) for panel in figure.axes] == [expected] * 2
    outlines = [patch.get_edgecolor() for patch in figure.axes[0].patches]
    colours = ["white", CLASS_COLOURS[TrackClass.RAIN], CLASS_COLOURS[TrackClass.CAR]]
    assert outlines == [to_rgba(colour) for colour in colours]
    figure.draw_without_rendering()
    (legend,) = figure.legends
    assert len(legend.get_texts()) == len(CLASS_COLOURS)
    box = legend.get_window_extent()
    assert not any(box.overlaps(panel.get_tightbbox()) for panel in figure.axes)
    assert figure.bbox.containsx(box.x0)
    assert figure.bbox.containsx(box.x1)


def test_a_scan_of_nothing_is_drawn_without_a_warning() -> None:
    scan = Scan.of(np.full((100, 4), np.nan))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figure = annotation_figure(scan, np.full(100, UNKNOWN), Scene(SCENE.road), "nothing")
        figure.draw_without_rendering()
    assert [dots(panel) for panel in figure.axes] == [{}, {}]
    assert figure.legends[0].get_texts() == []
    assert [len(panel.patches) for panel in figure.axes] == [1, 0]  # the road alone
