"""One scan as several methods clean it, side by side."""

import textwrap
from collections.abc import Iterator, Mapping

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from derain.evaluation.counts import Counts
from derain.evaluation.text_tables import number_text
from derain.pictures.palette import OUTCOMES, WITHOUT_LABELS, outcomes
from derain.pictures.scan_pictures import (
    draw_as_seen,
    draw_from_above,
    explain_colours,
    input_title,
    label_once,
)
from derain.scan import Scan

# Columns that a screen shows at once; further panels go below.
MOST_PANELS_IN_A_ROW = 5

# Letters of a title that stay within their panel.
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
        rain: Points that are rain, bool (N,); None where it is not known, and then every point
            that a method removes counts as rain.
        title: Heading.
    """
    panels = {input_title(scan): None, **dict(_panels(predicted, rain))}
    blocks = -(-len(panels) // MOST_PANELS_IN_A_ROW)
    columns = -(-len(panels) // blocks)  # blocks of one width, as far as the panels allow
    figure = Figure(figsize=(4 * columns, 6 * blocks + 1), layout="constrained")
    figure.suptitle(title)
    axes = figure.subplots(2 * blocks, columns, squeeze=False, height_ratios=[3, 2] * blocks)
    # Panels from left to right, block by block, each a pair of axes one above the other.
    pairs = axes.reshape(blocks, 2, columns).transpose(0, 2, 1).reshape(-1, 2)
    for (above, ahead), (name, outcome) in zip(pairs, panels.items(), strict=False):
        above.set_title(textwrap.fill(name, TITLE_WIDTH), fontsize=10)
        draw_from_above(above, scan, outcome)
        draw_as_seen(ahead, scan, outcome)
    for unused in pairs[len(panels) :].flat:
        unused.set_axis_off()
    label_once(pairs[0])
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
