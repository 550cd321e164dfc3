"""Pictures of scans from above and as the sensor sees them, with the results of derainers."""

import os
import sys
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb, to_rgba_array
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.text import Text
from numpy.typing import NDArray

from derain.errors import InputError, printable
from derain.evaluation.counts import Counts
from derain.evaluation.text_tables import number_text
from derain.files.atomic import replacing
from derain.pictures.palette import BACKGROUND, OUTCOMES, SOLID, WITHOUT_LABELS, outcomes
from derain.scan import Bools, Floats, Ints, Scan
from derain.system.open3d_import import import_open3d
from derain.views.directions import directions

# Shades of grey for intensities.
SHADES = 64

# Colours whose channels differ by less are grey.
GREY = 0.2

# Area of a coloured point, in points of print squared: the first, divided by the root of the number
# of points in its colour, but at most the second.
ALONE, LARGEST = 60, 16

# Panels side by side on a screen; further ones go below.
MOST_PANELS_IN_A_ROW = 5

# Letters of a title in a line, which fit above a panel.
TITLE_WIDTH = 44


def before_after_figure(scan: Scan, predicted: Bools, title: str) -> Figure:
    """One scan with the rain found in it, and without that rain.

    Args:
        scan: The scan.
        predicted: Points called rain, bool (N,).
        title: Heading.
    """
    figure = titled_figure(14, 9, title)
    columns = figure.subplots(2, 2, sharex="row", sharey="row", height_ratios=(3, 2)).T
    kept = scan.take(~predicted)
    before = f"before: {scan.valid.sum():,} points, {predicted.sum():,} of them rain"
    after = f"after: {kept.valid.sum():,} points"
    nothing = np.zeros(len(kept), int)
    draw_columns(columns, [(before, scan, predicted.astype(int)), (after, kept, nothing)])
    return figure


def comparison_figure(
    scan: Scan, predicted: Mapping[str, Bools], rain: Bools | None, title: str
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


def _panels(predicted: Mapping[str, Bools], rain: Bools | None) -> Iterator[tuple[str, Ints]]:
    if rain is not None:
        yield f"truth: {rain.sum():,} points of rain", rain.astype(np.int64)
    for name, called_rain in predicted.items():
        if rain is None:
            yield f"{name}: {called_rain.sum():,} points removed", called_rain.astype(np.int64)
        else:
            iou = number_text(Counts.of(called_rain, rain).iou)
            yield f"{name}: IoU {iou}", outcomes(called_rain, rain)


def show_comparison(scan: Scan, predicted: Mapping[str, Bools], rain: Bools | None) -> None:
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
        points = open3d.utility.Vector3dVector(scan.xyz[seen].astype(np.float64))
        cloud = open3d.geometry.PointCloud(points)
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


def titled_figure(width: float, height: float, title: str, **options: Any) -> Figure:
    """A figure that leaves room for its heading and its legend.

    Args:
        width: Its width, inches.
        height: Its height, inches.
        title: Heading.
        options: Of matplotlib's ``suptitle``.
    """
    figure = Figure(figsize=(width, height), layout="constrained")
    figure.suptitle(title, **options)
    return figure


def save(figure: Figure, path: Path) -> None:
    """Writes a figure in the format that the suffix names, such as PNG.

    Raises:
        InputError: An output that cannot be written.
    """
    for text in figure.findobj(Text):
        # Names of files may hold control sequences, or $, which begins mathematics.
        text.set_text("\n".join(map(printable, text.get_text().split("\n"))))
        text.set_parse_math(False)
    with replacing(path) as temporary:
        figure.savefig(temporary, dpi=110)


def explain_colours(figure: Figure, colours: Mapping[str, str] = OUTCOMES) -> None:
    """Puts a legend below everything else.

    Args:
        figure: The figure.
        colours: Colours by their meaning.
    """
    legend_below(figure, [Patch(color=colour, label=name) for name, colour in colours.items()])


def legend_below(figure: Figure, handles: Sequence[Any], **options: Any) -> None:
    """Puts a legend below everything else, in one row.

    Args:
        figure: The figure.
        handles: Entries of the legend, with labels.
        options: Of matplotlib's ``legend``.
    """
    columns = max(len(handles), 1)
    options = {"handles": handles, "ncols": columns, "frameon": False, **options}
    figure.legend(loc="outside lower center", **options)


def input_title(scan: Scan) -> str:
    """Title of the panel that shows the scan before cleaning."""
    return "input" if scan.measured_intensity is None else "input: intensity"


def draw_columns(
    columns: NDArray[np.object_],
    panels: Sequence[tuple[str, Scan, Ints | None]],
    fontsize: float | str = "large",
) -> None:
    """Draws scans side by side, each from above and below that as the sensor sees it.

    Args:
        columns: Axes of the panels, (K, 2); those of the first column are labelled.
        panels: Title, scan and outcomes of each column: of each point a number of ``OUTCOMES``,
            int64 (N,); None shows intensity where it was measured.
        fontsize: Size of the titles, as matplotlib takes it.
    """
    for (above, ahead), (title, scan, outcome) in zip(columns, panels, strict=True):
        above.set_title(title, fontsize=fontsize)
        _draw_from_above(above, scan, outcome)
        _draw_as_seen(ahead, scan, outcome)
    above, ahead = columns[0]
    above.set(ylabel="forward / m", xlabel="right / m")
    ahead.set(ylabel="inclination / °", xlabel="azimuth, to the right / °")


def _draw_from_above(axes: Axes, scan: Scan, outcome: Ints | None) -> None:
    """Draws a scan from above, in metres, forward being up; most points are within the limits."""
    seen = scan.valid
    x, y, _ = scan.xyz[seen].T
    scatter(axes, -y, x, *_colours(scan, outcome, seen))
    axes.set_aspect("equal")
    if len(x):
        nearest, farthest = np.percentile(x, [1, 97])
        half = 0.5 * max(farthest - nearest, 1e-3)
        middle, centre = 0.5 * (nearest + farthest), float(np.median(-y))
        axes.set_xlim(centre - 1.2 * half, centre + 1.2 * half)
        axes.set_ylim(middle - half, middle + half)


def scatter(
    axes: Axes, x: NDArray[np.floating], y: NDArray[np.floating], colours: Floats, number: Ints
) -> None:
    """Draws points, the rarest colour last and largest, so that none covers it.

    Args:
        axes: The axes to draw in.
        x: Positions of the points along the axis to the right, (N,).
        y: Positions along the axis upwards, (N,).
        colours: RGBA, float64 (K, 4).
        number: Number of each point's colour, int64 (N,).
    """
    size = np.clip(60_000 / max(len(x), 1), 0.3, 3)  # small where there are many
    points = np.bincount(number, minlength=len(colours))
    is_grey = np.ptp(colours[:, :3], axis=1) < GREY
    # Colour by colour, which is several times as fast; grey first and the rarest colour last, on
    # top.
    for chosen in np.lexsort([-points, ~is_grey]):
        if not points[chosen]:
            continue
        rows, area = number == chosen, size
        if not is_grey[chosen]:
            area = np.clip(ALONE / np.sqrt(points[chosen]), size, LARGEST)
        axes.scatter(x[rows], y[rows], s=area, color=colours[chosen], linewidths=0, rasterized=True)
    axes.set_facecolor(BACKGROUND)
    axes.tick_params(labelsize=8)


def _draw_as_seen(axes: Axes, scan: Scan, outcome: Ints | None) -> None:
    """Draws inclination over azimuth, in degrees, left being left."""
    seen = scan.valid
    azimuth, inclination = directions(scan.xyz[seen])
    scatter(axes, -azimuth, inclination, *_colours(scan, outcome, seen))
    # Where all points have one direction, matplotlib chooses the limits.
    if len(azimuth) and np.ptp(azimuth) and np.ptp(inclination):
        axes.set_xlim(*np.percentile(-azimuth, [0, 100]))
        axes.set_ylim(*np.percentile(inclination, [0.1, 99.9]))


def _colours(scan: Scan, outcome: Ints | None, rows: Bools) -> tuple[Floats, Ints]:
    """Colours, RGBA (K, 4), and the number of each point's colour, by its outcome or intensity."""
    if outcome is not None:
        return to_rgba_array(list(OUTCOMES.values())), outcome[rows]
    if scan.measured_intensity is None or not rows.any():
        return to_rgba_array(SOLID), np.zeros(np.count_nonzero(rows), np.int64)
    intensity = np.maximum(scan.measured_intensity[rows], 0)
    brightness = intensity / max(float(np.percentile(intensity, 98)), 1e-6)
    share = np.sqrt(np.clip(brightness, 0, 1))
    shades = np.linspace(0.25, 1, SHADES)  # from dark to bright
    return to_rgba_array([str(shade) for shade in shades]), (share * (SHADES - 1)).astype(np.int64)
