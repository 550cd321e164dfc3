"""The picture of error against time, from which to choose a method."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter
from matplotlib.transforms import Bbox

from derain.scan import Floats

# Smaller errors are drawn as this one: a logarithmic axis has no place for an error of 0.
LEAST_ERROR = 1e-4

# Colour and marker of each group.
LOOKS = {"network": ("#1f77b4", "o"), "filter": ("#d98200", "s"), "baseline": ("#6b7280", "D")}

# Places of a label around its marker, in points from it, by preference; and on which sides of it
# they lie, right and up, -1, 0 or 1 each.
ANGLES = np.radians([0, 180, 45, -45, 135, -135, 90, -90])
DIRECTIONS = np.column_stack([np.cos(ANGLES), np.sin(ANGLES)])
DISTANCES = (8, 16, 28, 42, 60, 84)
OFFSETS = np.concatenate([distance * DIRECTIONS for distance in DISTANCES])
SIDES = np.tile(DIRECTIONS.round().astype(int), (len(DISTANCES), 1))

FONT_SIZE, POINTS_PER_INCH = 9, 72


@dataclass(frozen=True)
class Standing:
    """A method in the picture.

    Attributes:
        title: Its title.
        error: 1 - IoU.
        milliseconds: Time from file to mask, above 0.
        group: ``network``, ``filter`` or ``baseline``.
        size: Size of its file, bytes; None where it has none.
    """

    title: str
    error: float
    milliseconds: float
    group: str
    size: int | None = None

    @property
    def place(self) -> tuple[float, float]:
        """Position of its marker: milliseconds, and the error as it is drawn."""
        return self.milliseconds, max(self.error, LEAST_ERROR)

    @property
    def label(self) -> str:
        """Text beside its marker: its title and the size of its file."""
        return self.title if self.size is None else f"{self.title} · {readable_size(self.size)}"


def readable_size(size: int) -> str:
    """A number of bytes in kilobytes, or from a million on in megabytes.

    Args:
        size: Bytes, 0 or more.
    """
    return f"{size / 1e6:.1f} MB" if size >= 999_500 else f"{max(1, round(size / 1e3))} kB"


def pareto_front(standings: Sequence[Standing]) -> list[Standing]:
    """The Pareto front: the methods that no other surpasses, by ascending time.

    One method surpasses another if it is at least as fast and makes no more errors, and is better
    in one of the two. Of methods that are equally fast and good, only the first is on the front.
    """
    front: list[Standing] = []
    for standing in sorted(standings, key=lambda method: (method.milliseconds, method.error)):
        if not front or standing.error < front[-1].error:
            front.append(standing)
    return front


def speed_error_figure(standings: Sequence[Standing], title: str) -> Figure:
    """Error over milliseconds, both logarithmic, and the Pareto front; sizes beside the titles.

    Args:
        standings: The methods, one or more.
        title: Heading.
    """
    figure = Figure(figsize=(10, 6.5))
    FigureCanvasAgg(figure)  # measures the labels
    figure.subplots_adjust(left=0.09, right=0.97, bottom=0.1, top=0.92)
    axes = figure.add_subplot()
    axes.set(xscale="log", yscale="log", title=title)
    axes.set_xlabel("milliseconds a scan, from file to mask (median)")
    axes.set_ylabel("error: 1 - IoU of rain")
    front = np.transpose([standing.place for standing in pareto_front(standings)])
    axes.plot(*front, color="#9ca3af", linewidth=1.2, zorder=1, label="Pareto front")
    for group, (colour, marker) in LOOKS.items():
        if places := [standing.place for standing in standings if standing.group == group]:
            x, y = np.transpose(places)
            axes.scatter(x, y, marker=marker, color=colour, s=42, zorder=2, label=group)
    axes.margins(0.12)
    axes.grid(which="both", color="#e5e7eb", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.tick_params(which="both", length=3.5, pad=3.5)  # all numbers on one line
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(FuncFormatter(_few_digits))
    axes.legend(loc="best", frameon=False)
    figure.draw_without_rendering()  # so that extents are known
    _label(axes, standings)
    return figure


def _label(axes: Axes, standings: Sequence[Standing]) -> None:
    """Writes each label where it covers no marker and no other label, nearest to its own marker."""
    markers = axes.transData.transform([standing.place for standing in standings])
    legend = axes.get_legend()
    assert legend is not None
    taken = [Bbox.from_bounds(x - 5, y - 5, 10, 10) for x, y in markers]
    taken.append(legend.get_window_extent())
    for number, standing in enumerate(standings):
        size = _size(axes, standing.label)
        anchors = markers[number] + OFFSETS * axes.figure.dpi / POINTS_PER_INCH
        boxes = [Bbox([low, low + size]) for low in anchors - size * (1 - SIDES) / 2]
        chosen = 0  # where no place is free, the first: it covers others
        for place, box in enumerate(boxes):
            inside = all(map(axes.bbox.contains, *box.corners().T))
            # A label without a line to its marker is taken for that of the nearest marker.
            gaps = _gaps(box, markers)
            clear = place >= len(DIRECTIONS) or gaps[number] == gaps.min()
            if inside and clear and not box.count_overlaps(taken):
                chosen = place
                break
        _annotate(axes, standing, chosen)
        taken.append(boxes[chosen])


def _size(axes: Axes, label: str) -> Floats:
    """Width and height of a label, float64 (2,), pixels."""
    text = axes.text(0, 0, label, fontsize=FONT_SIZE)
    size = np.array(text.get_window_extent().size)
    text.remove()
    return size


def _gaps(box: Bbox, places: Floats) -> Floats:
    """Distance of each place, (n, 2), from a box, float64 (n,), in the box's unit."""
    beyond = np.maximum(np.maximum(box.min - places, places - box.max), 0)
    return np.asarray(np.hypot(*beyond.T))


def _annotate(axes: Axes, standing: Standing, place: int) -> None:
    """Writes a label at one of ``OFFSETS``, with a line to its marker where it is not beside it."""
    right, up = SIDES[place]
    line = {
        "arrowstyle": "-",
        "color": "#9ca3af",
        "linewidth": 0.6,
        "relpos": ((1 - right) / 2, (1 - up) / 2),  # to the nearest of its corners
    }
    axes.annotate(
        standing.label,
        standing.place,
        xytext=OFFSETS[place],
        textcoords="offset points",
        ha=("center", "left", "right")[right],
        va=("center", "bottom", "top")[up],
        fontsize=FONT_SIZE,
        # Keeps the letters readable where the line of the Pareto front passes them.
        bbox={"boxstyle": "square,pad=0.1", "color": "white", "alpha": 0.8},
        arrowprops=line if place >= len(DIRECTIONS) else None,
    )


def _few_digits(value: float, _: object) -> str:
    """Labels 2, 3 and 5 between the powers of ten."""
    digit = value / 10 ** np.floor(np.log10(value))
    return f"{value:g}" if round(digit) in (2, 3, 5) else ""
