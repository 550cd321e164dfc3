"""Pictures of a derainer's errors: by class and range, and over the threshold."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from derain.evaluation.counts import ClassCounts
from derain.evaluation.operating_points import OperatingPoints
from derain.evaluation.text_tables import number_text
from derain.pictures.palette import LOST, MISSED
from derain.pictures.scan_pictures import legend_below, titled_figure

# Depth of the colour of a share, lightest and darkest at these two: errors span decades.
DEPTH = LogNorm(1e-4, 1.0, clip=True)

# Colours of cells, as in the pictures of scans: rain that is kept, and others that are removed.
LEFT = LinearSegmentedColormap.from_list("left", ["#fffdf3", MISSED])
LOST_SHADES = LinearSegmentedColormap.from_list("lost", ["#fff8f8", LOST])

PRECISION, RECALL, IOU = "#d98200", "#1f77b4", "#111827"
FAINT_TEXT = "#9ca3af"

# IoU of the background lines of a precision-recall curve.
LINES_OF_IOU = (0.2, 0.4, 0.6, 0.8, 0.9)


def errors_figure(
    counts: Mapping[str, Sequence[ClassCounts]], bands: Sequence[str], title: str
) -> Figure:
    """A table of the share of each class that is judged wrongly, by range.

    Rain comes first, then the class with most points judged wrongly.

    Args:
        counts: Counts of each class by band, by the class's name.
        bands: Names of the bands.
        title: Heading.
    """
    rows = _rows(counts)
    figure = Figure(figsize=(9, 1.5 + 0.42 * len(rows)), layout="constrained")
    axes = figure.add_subplot()
    axes.set_title(title, fontsize=11)
    axes.imshow([[_colour(cell) for cell in row] for row in rows.values()], aspect="auto")
    for y, row in enumerate(rows.values()):
        for x, cell in enumerate(row):
            axes.text(x, y, _text(cell), ha="center", va="center", fontsize=7.5)
    axes.set_xticks(range(len(bands) + 1), [*bands, "all ranges"])
    axes.set_yticks(range(len(rows)), list(rows))
    axes.xaxis.tick_top()
    axes.tick_params(length=0)
    axes.axvline(len(bands) - 0.5, color="black", linewidth=0.8)
    axes.spines[:].set_visible(False)
    left = Patch(color=LEFT(0.8), label="rain that is left")
    lost = Patch(color=LOST_SHADES(0.8), label="solid that is lost")
    explained = "share of the class judged wrongly, and its number of points"
    legend_below(figure, [left, lost], title=explained, fontsize=9, title_fontsize=9)
    return figure


def operating_points_figure(points: OperatingPoints, threshold: float, title: str) -> Figure:
    """Precision over recall with the chosen threshold, and both over the threshold.

    Args:
        points: Counts at many thresholds, of data with rain.
        threshold: The chosen threshold.
        title: Heading.
    """
    figure = titled_figure(12, 4.8, title, fontsize=11)
    curve, thresholds = figure.subplots(1, 2)
    chosen, best = points.at(threshold), points.best
    _draw_curve(curve, points, chosen, best)
    _draw_over_threshold(thresholds, points, chosen, best)
    return figure


def _rows(counts: Mapping[str, Sequence[ClassCounts]]) -> dict[str, list[ClassCounts]]:
    """The rows of the table, each with its total at the end; only classes with points."""
    rows = {}
    for name, (first, *others) in counts.items():
        total = sum(others, first)
        title = f"{name} (rain)" if total.rain and name != "rain" else name
        if total.points:
            rows[title] = [first, *others, total]
    return dict(sorted(rows.items(), key=lambda row: (not row[1][-1].rain, -row[1][-1].wrong)))


def _colour(cell: ClassCounts) -> tuple[float, ...]:
    if not cell.wrong:
        return (1.0, 1.0, 1.0, 1.0)
    return (LEFT if cell.rain else LOST_SHADES)(DEPTH(cell.share_wrong))


def _text(cell: ClassCounts) -> str:
    if not cell.points:
        return "-"
    return f"{cell.share_wrong:.2%}\n{cell.wrong:,} of {cell.points:,}"


def _draw_curve(axes: Axes, points: OperatingPoints, chosen: int, best: int) -> None:
    for iou in LINES_OF_IOU:
        recall = np.linspace(iou, 1, 100)
        # From IoU = 1 / (1 / precision + 1 / recall - 1).
        axes.plot(recall, 1 / (1 / iou - 1 / recall + 1), color="#d1d5db", linewidth=1, zorder=0)
        axes.text(1.005, iou, f" IoU {iou:g}", color=FAINT_TEXT, fontsize=8, va="center")
    axes.plot(points.recall, points.precision, color=RECALL, linewidth=1.8, zorder=2)
    for number, name, face in ((best, "most IoU", "white"), (chosen, "chosen", IOU)):
        counts = points.counts(number)
        precision = number_text(counts.precision)
        scores = f"precision {precision}, recall {counts.recall:.3f}, IoU {counts.iou:.3f}"
        label = f"{name}: threshold {points.thresholds[number]:.4g}\n{scores}"
        (marker,) = axes.plot(counts.recall, counts.precision, "o", color=IOU, label=label)
        marker.set(markerfacecolor=face, markersize=8, zorder=3)
    axes.set(xlim=(0, 1), ylim=(0, 1.02), xlabel="recall", ylabel="precision")
    axes.set_title(f"average precision {points.average_precision:.3f}", fontsize=10)
    axes.legend(loc="lower left", fontsize=8.5)


def _draw_over_threshold(axes: Axes, points: OperatingPoints, chosen: int, best: int) -> None:
    for name, values, colour in (
        ("precision", points.precision, PRECISION),
        ("recall", points.recall, RECALL),
        ("IoU", points.iou, IOU),
    ):
        axes.plot(points.thresholds, values, color=colour, linewidth=1.8, label=name)
    axes.axvline(points.thresholds[chosen], color=IOU, linewidth=1.2, label="chosen")
    axes.axvline(points.thresholds[best], color=IOU, linewidth=1.2, linestyle=":", label="most IoU")
    axes.set(xlim=(0, 1), ylim=(0, 1.02), xlabel="threshold: more probable points are rain")
    axes.set_title("scores at other thresholds", fontsize=10)
    axes.grid(color="#e5e7eb", linewidth=0.6)
    axes.legend(loc="lower center", fontsize=8.5, ncols=3)
