"""Pictures of what a data set holds: how often it rains how hard, and points by class."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from derain.sources.contents import Tally, class_name, rate_name

# Clean air, then ever more rain; grey where it is not known.
CLEAN, UNKNOWN = "#c9b458", "#9aa3ad"
LIGHTEST, HEAVIEST = 0.35, 0.95


def statistics_figure(
    tallies: Mapping[float | None, Tally], classes: Mapping[int, str], title: str
) -> Figure:
    """Share of the sequences, and points of each class on a logarithmic axis, by rain rate.

    Args:
        tallies: What was counted at each rain rate in mm/h; None where it is not known.
        classes: Names of the classes, by id.
        title: Heading.

    Source: what is shown is that of figures 3 and 5 of REHEARSE-3D.
    """
    figure = Figure(figsize=(13, 5.5), layout="constrained")
    figure.suptitle(title)
    shares, points = figure.subplots(1, 2, width_ratios=(1, 3))
    colours = _colours(tallies)
    _draw_shares(shares, tallies, colours)
    _draw_points(points, tallies, classes, colours)
    figure.legend(
        handles=points.containers,
        loc="outside lower center",
        ncols=max(len(tallies), 1),
        frameon=False,
    )
    return figure


def _colours(tallies: Mapping[float | None, Tally]) -> dict[float | None, Any]:
    from matplotlib import colormaps

    rates = [rate for rate in tallies if rate]
    shades = colormaps["Blues"](np.linspace(LIGHTEST, HEAVIEST, len(rates)))
    return {None: UNKNOWN, 0.0: CLEAN, **dict(zip(rates, shades, strict=True))}


def _draw_shares(
    axes: Axes, tallies: Mapping[float | None, Tally], colours: Mapping[float | None, Any]
) -> None:
    sequences = [tally.sequences for tally in tallies.values()]
    axes.pie(
        sequences,
        labels=[
            f"{rate_name(rate)}: {tally.sequences / sum(sequences):.0%}"
            for rate, tally in tallies.items()
        ],
        colors=[colours[rate] for rate in tallies],
        startangle=90,
        counterclock=False,
    )
    axes.set_title(f"sequences: {sum(sequences):,}")


def _draw_points(
    axes: Axes,
    tallies: Mapping[float | None, Tally],
    classes: Mapping[int, str],
    colours: Mapping[float | None, Any],
) -> None:
    ids = sorted({id_ for tally in tallies.values() for id_ in tally.labelled})
    width = 0.8 / max(len(tallies), 1)
    for place, (rate, tally) in enumerate(tallies.items()):
        axes.bar(
            np.arange(len(ids)) - 0.4 + (place + 0.5) * width,
            [tally.labelled[id_] for id_ in ids],
            width,
            color=colours[rate],
            label=rate_name(rate),
        )
    axes.set_xticks(range(len(ids)), [class_name(id_, classes) for id_ in ids], rotation=30)
    axes.set_yscale("log")
    axes.set_ylabel("points")
    axes.set_title("labelled points by class" if ids else "no labels")
