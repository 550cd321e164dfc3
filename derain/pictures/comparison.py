"""One scan as several methods clean it: side by side in a picture, or each in a window."""

import os
import sys
import textwrap
from collections.abc import Iterator, Mapping

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from numpy.typing import NDArray

from derain.errors import InputError
from derain.evaluation.counts import Counts
from derain.evaluation.text_tables import number_text
from derain.pictures.palette import BACKGROUND, OUTCOMES, WITHOUT_LABELS, outcomes
from derain.pictures.scan_pictures import (
    draw_columns,
    explain_colours,
    input_title,
    titled_figure,
)
from derain.scan import Scan
from derain.system.open3d_import import import_open3d

# Panels side by side on a screen; further ones go below.
MOST_PANELS_IN_A_ROW = 5

# Letters of a title in a line, which fit above a panel.
TITLE_WIDTH = 44


def comparison_figure(
    scan: Scan,
    predicted: Mapping[str, NDArray[np.bool_]],
    rain: NDArray[np.bool_] | None,
    title: str,
) -> Figure:
    """Input, truth, and each method's result, from above and as the sensor sees it.

    Args:
        scan: The scan.
        predicted: Points that each method calls rain, bool (N,), by its name.
        rain: Points that are rain, bool (N,); None where that is not known: each panel then shows
            what its method removes.
        title: Heading.
    """
    panels = {input_title(scan): None, **dict(_panels(predicted, rain))}
    blocks = -(-len(panels) // MOST_PANELS_IN_A_ROW)
    columns = -(-len(panels) // blocks)  # of equal width where possible
    figure = titled_figure(4 * columns, 6 * blocks + 1, title)
    axes = figure.subplots(2 * blocks, columns, squeeze=False, height_ratios=[3, 2] * blocks)
    # Panels from left to right, block by block, each a pair of axes one above the other.
    pairs = axes.reshape(blocks, 2, columns).transpose(0, 2, 1).reshape(-1, 2)
    drawn = [(textwrap.fill(name, TITLE_WIDTH), scan, panels[name]) for name in panels]
    draw_columns(pairs[: len(panels)], drawn, fontsize=10)
    for unused in pairs[len(panels) :].flat:
        unused.set_axis_off()
    explain_colours(figure, WITHOUT_LABELS if rain is None else OUTCOMES)
    return figure


def _panels(
    predicted: Mapping[str, NDArray[np.bool_]], rain: NDArray[np.bool_] | None
) -> Iterator[tuple[str, NDArray[np.int64]]]:
    if rain is not None:
        yield f"truth: {rain.sum():,} points of rain", rain.astype(np.int64)
    for name, called_rain in predicted.items():
        if rain is None:
            yield f"{name}: {called_rain.sum():,} points removed", called_rain.astype(np.int64)
        else:
            iou = number_text(Counts.of(called_rain, rain).iou)
            yield f"{name}: IoU {iou}", outcomes(called_rain, rain)


def show_comparison(
    scan: Scan, predicted: Mapping[str, NDArray[np.bool_]], rain: NDArray[np.bool_] | None
) -> None:
    """Opens a window for each method, one after the other, in which to turn and zoom.

    Args:
        scan: The scan.
        predicted: Points that each method calls rain, bool (N,), by its name.
        rain: Points that are rain, bool (N,); None where that is not known.

    Raises:
        InputError: No screen, or no Open3D.
    """
    if sys.platform == "linux" and not (
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    ):
        raise _no_screen()
    open3d = import_open3d()
    colours = np.array([to_rgb(colour) for colour in OUTCOMES.values()])
    seen = scan.valid
    for name, called_rain in predicted.items():
        outcome = outcomes(called_rain, called_rain if rain is None else rain)
        cloud = open3d.geometry.PointCloud(
            open3d.utility.Vector3dVector(scan.xyz[seen].astype(np.float64))
        )
        cloud.colors = open3d.utility.Vector3dVector(colours[outcome[seen]])
        window = open3d.visualization.Visualizer()
        if not window.create_window(window_name=f"{scan.name}: {name}"):
            raise _no_screen()
        window.add_geometry(cloud)
        window.get_render_option().background_color = np.array(to_rgb(BACKGROUND))
        window.get_render_option().point_size = 2.0
        window.run()
        window.destroy_window()


def _no_screen() -> InputError:
    return InputError("--window", "there is no screen to open it on", "Give --out for a PNG.")
