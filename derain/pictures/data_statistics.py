"""Pictures of a data set: its rain rates, and its points by class."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatter

from derain.evaluation.contents import Contents, class_name, rate_name
from derain.pictures.scan_pictures import legend_below, titled_figure

# Without rain, and where the rate is unknown; rates have shades between the next two.
CLEAN, UNKNOWN = "#c9b458", "#9aa3ad"
LIGHTEST, HEAVIEST = 0.35, 0.95

# Counts, and colours, by rain rate in mm/h; None where the rate is unknown.
CountsByRate = Mapping[float | None, Contents]
ColourByRate = Mapping[float | None, Any]


def statistics_figure(contents: CountsByRate, classes: Mapping[int, str], title: str) -> Figure:
    """Share of the sequences, and points of each class on a logarithmic axis, by rain rate.

    Args:
        contents: Counts by rain rate in mm/h; None for an unknown rate.
        classes: Names of the classes, by id.
        title: Heading.

    Source: what is shown is that of figures 3 and 5 of REHEARSE-3D.
    """
    figure = titled_figure(13, 5.5, title)
    shares, points = figure.subplots(1, 2, width_ratios=(1, 3))
    colours = _colours(contents)
    _draw_shares(shares, contents, colours)
    _draw_points(points, contents, classes, colours)
    legend_below(figure, points.containers)
    return figure


def _colours(contents: CountsByRate) -> ColourByRate:
    rates = [rate for rate in contents if rate]
    shades = colormaps["Blues"](np.linspace(LIGHTEST, HEAVIEST, len(rates)))
    return {None: UNKNOWN, 0.0: CLEAN, **dict(zip(rates, shades, strict=True))}


def _draw_shares(axes: Axes, contents: CountsByRate, colours: ColourByRate) -> None:
    sequences = {rate: found.sequences for rate, found in contents.items()}
    total = sum(sequences.values())
    labels = [f"{rate_name(rate)}: {part / total:.0%}" for rate, part in sequences.items()]
    shades = [colours[rate] for rate in sequences]
    parts = [*sequences.values()]
    axes.pie(parts, labels=labels, colors=shades, startangle=90, counterclock=False)
    axes.set_title(f"sequences: {total:,}")


def _draw_points(
    axes: Axes, contents: CountsByRate, classes: Mapping[int, str], colours: ColourByRate
) -> None:
    ids = sorted({id_ for found in contents.values() for id_ in found.labelled})
    width = 0.8 / max(len(contents), 1)
    for place, (rate, found) in enumerate(contents.items()):
        left = np.arange(len(ids)) - 0.4 + (place + 0.5) * width
        heights = [found.labelled[id_] for id_ in ids]
        axes.bar(left, heights, width, color=colours[rate], label=rate_name(rate))
    axes.set_xticks(range(len(ids)), [class_name(id_, classes) for id_ in ids], rotation=30)
    axes.set_yscale("log")
    # The usual ones of this axis write mathematics, which pictures are saved without.
    axes.yaxis.set_major_formatter("{x:,.0f}")
    axes.yaxis.set_minor_formatter(LogFormatter())
    axes.set_ylabel("points")
    axes.set_title("labelled points by class" if ids else "no labels")
