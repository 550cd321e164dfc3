"""Pictures of scans: from above, as the sensor sees them, and what a derainer made of them."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba_array
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.text import Text
from numpy.typing import NDArray

from derain.errors import InputError, printable
from derain.files.atomic import replacing
from derain.pictures.palette import BACKGROUND, OUTCOMES, SOLID, outcomes
from derain.scan import Scan

# Steps of brightness that intensity is shown in.
SHADES = 64

# Colours whose channels differ by less are grey.
GREY = 0.2

# Area of a coloured point, in points of print squared: the first over the root of how many there
# are of its colour, and at most the second.
ALONE, LARGEST = 60, 16


def judgement_figure(
    scan: Scan, predicted: NDArray[np.bool_], rain: NDArray[np.bool_], title: str
) -> Figure:
    """Input, truth, prediction and error of one scan, from above and as the sensor sees it.

    Args:
        scan: The scan.
        predicted: Points called rain, bool (N,).
        rain: Points that are rain, bool (N,).
        title: Heading.
    """
    figure = Figure(figsize=(16, 7), layout="constrained")
    figure.suptitle(title)
    columns = figure.subplots(2, 4, sharex="row", sharey="row").T
    colourings = {
        input_title(scan): None,
        "truth": rain.astype(int),
        "prediction": predicted.astype(int),
        "error": outcomes(predicted, rain),
    }
    for (above, ahead), (name, outcome) in zip(columns, colourings.items(), strict=True):
        above.set_title(name)
        draw_from_above(above, scan, outcome)
        draw_as_seen(ahead, scan, outcome)
    label_once(columns[0])
    explain_colours(figure)
    return figure


def before_after_figure(scan: Scan, predicted: NDArray[np.bool_], title: str) -> Figure:
    """One scan as it came, with what was found in it, and what is left.

    Args:
        scan: The scan.
        predicted: Points called rain, bool (N,).
        title: Heading.
    """
    figure = Figure(figsize=(14, 9), layout="constrained")
    figure.suptitle(title)
    columns = figure.subplots(2, 2, sharex="row", sharey="row", height_ratios=(3, 2)).T
    kept = scan.take(~predicted)
    parts = {
        f"before: {scan.valid.sum():,} points, {predicted.sum():,} of them rain": (scan, predicted),
        f"after: {kept.valid.sum():,} points": (kept, np.zeros(len(kept), bool)),
    }
    for (above, ahead), (name, (part, rain)) in zip(columns, parts.items(), strict=True):
        above.set_title(name)
        draw_from_above(above, part, rain.astype(int))
        draw_as_seen(ahead, part, rain.astype(int))
    label_once(columns[0])
    return figure


def save(figure: Figure, path: Path) -> None:
    """Writes a figure in the format that the suffix names, such as PNG.

    Raises:
        InputError: An output that cannot be written, or the suffix of no picture.
    """
    if path.suffix[1:].lower() not in figure.canvas.get_supported_filetypes():
        raise InputError(path, f"'{path.suffix}' is not the suffix of a picture", "Name it .png.")
    for text in figure.findobj(Text):
        # Names of files may stand in it: what is no text, control sequences, $ of mathematics.
        text.set_text("\n".join(map(printable, text.get_text().split("\n"))))
        text.set_parse_math(False)
    with replacing(path) as temporary:
        figure.savefig(temporary, dpi=110)


def explain_colours(figure: Figure, colours: Mapping[str, str] = OUTCOMES) -> None:
    """Puts a legend below everything else.

    Args:
        figure: The figure.
        colours: Colours by what they mean.
    """
    figure.legend(
        handles=[Patch(color=colour, label=name) for name, colour in colours.items()],
        loc="outside lower center",
        ncols=len(colours),
        frameon=False,
    )


def input_title(scan: Scan) -> str:
    """The heading of a panel that shows a scan as it came."""
    return "input" if scan.intensity is None else "input: intensity"


def draw_from_above(axes: Axes, scan: Scan, outcome: NDArray[np.int64] | None) -> None:
    """Draws x forward and y to the left, in metres, as far as most points reach.

    Args:
        axes: Where to draw.
        scan: The scan; points that cannot be judged are not drawn.
        outcome: What became of each point, as a number of ``OUTCOMES``, int64 (N,); None shows
            intensity.
    """
    seen = scan.valid
    x, y, _ = scan.xyz[seen].T
    _scatter(axes, -y, x, *_colours(scan, outcome, seen))
    axes.set_aspect("equal")
    if len(x):
        nearest, farthest = np.percentile(x, [1, 97])
        half = 0.5 * max(farthest - nearest, 1e-3)
        middle, centre = 0.5 * (nearest + farthest), float(np.median(-y))
        axes.set_xlim(centre - 1.2 * half, centre + 1.2 * half)
        axes.set_ylim(middle - half, middle + half)


def draw_as_seen(axes: Axes, scan: Scan, outcome: NDArray[np.int64] | None) -> None:
    """Draws azimuth, left being left, and inclination, in degrees.

    Args:
        axes: Where to draw.
        scan: The scan; points that cannot be judged are not drawn.
        outcome: As for :func:`draw_from_above`.
    """
    seen = scan.valid
    x, y, z = scan.xyz[seen].astype(np.float64).T
    azimuth = np.degrees(np.arctan2(y, x))
    inclination = np.degrees(np.arctan2(z, np.hypot(x, y)))
    _scatter(axes, -azimuth, inclination, *_colours(scan, outcome, seen))
    # Points in one direction leave the limits to matplotlib.
    if len(azimuth) and np.ptp(azimuth) and np.ptp(inclination):
        axes.set_xlim(*np.percentile(-azimuth, [0, 100]))
        axes.set_ylim(*np.percentile(inclination, [0.1, 99.9]))


def _colours(
    scan: Scan, outcome: NDArray[np.int64] | None, rows: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Colours, RGBA (K, 4), and the number of each row's own: its outcome, or its intensity."""
    if outcome is not None:
        return to_rgba_array(list(OUTCOMES.values())), outcome[rows]
    if scan.intensity is None or not rows.any():
        return to_rgba_array(SOLID), np.zeros(np.count_nonzero(rows), np.int64)
    intensity = np.maximum(scan.intensity[rows], 0)
    brightness = intensity / max(float(np.percentile(intensity, 98)), 1e-6)
    share = np.sqrt(np.clip(brightness, 0, 1))
    shades = np.linspace(0.25, 1, SHADES)  # from dark to bright
    return to_rgba_array([str(shade) for shade in shades]), (share * (SHADES - 1)).astype(np.int64)


def _scatter(
    axes: Axes,
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    colours: NDArray[np.float64],
    number: NDArray[np.int64],
) -> None:
    size = np.clip(60_000 / max(len(x), 1), 0.3, 3)  # small where there are many
    points = np.bincount(number, minlength=len(colours))
    is_grey = np.ptp(colours[:, :3], axis=1) < GREY
    # Colour by colour, which matplotlib draws several times as fast; grey first, and of the others
    # the rarest last, so that it lies on top.
    for chosen in np.lexsort([-points, ~is_grey]):
        rows = number == chosen
        if not rows.any():
            continue
        by_number = np.clip(ALONE / np.sqrt(points[chosen]), size, LARGEST)
        area = size if is_grey[chosen] else by_number
        axes.scatter(x[rows], y[rows], s=area, color=colours[chosen], linewidths=0, rasterized=True)
    axes.set_facecolor(BACKGROUND)
    axes.tick_params(labelsize=8)


def label_once(column: NDArray[np.object_]) -> None:
    """Names the axes of one pair of panels, from above and as seen, for all."""
    above, ahead = column
    above.set_ylabel("forward / m")
    above.set_xlabel("right / m")
    ahead.set_ylabel("inclination / °")
    ahead.set_xlabel("azimuth, to the right / °")
