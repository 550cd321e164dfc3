"""Pictures of a teacher's labels, and of what its student removes."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator

from derain.cards.card import DataCard
from derain.evaluation.answers import (
    FINE_EDGES,
    NOT_KNOWN,
    NOT_RAIN,
    RAIN,
    TEACHERS_ANSWERS,
    Answers,
    AnswersOfScan,
    answer_of,
    coarse_bands,
)
from derain.evaluation.counts import ratio
from derain.pictures import scan_pictures
from derain.pictures.palette import OUTCOMES
from derain.scan import Bools, Ints, Scan

# Distinct to colour-blind eyes and in grey.
OF_ANSWERS = {RAIN: "#1f77b4", NOT_KNOWN: "#f2c14e"}
STUDENT = "#111827"

# Half the height of a picture, metres: at least, and without rain.
LEAST_REACH, FAR = 10.0, 40.0

# Least upper limit of an axis of shares.
LEAST_TOP = 0.01

# Upper edge that the last, open band is drawn to, metres.
LAST_EDGE = FINE_EDGES[-1] + FINE_EDGES[1]

# Colours of the pictures of scans, as numbers of ``OUTCOMES``.
KEPT, REMOVED, LEFT, LOST = range(len(OUTCOMES))

# Fewest points in a band of range that a share is drawn for: with fewer it is chance.
FEWEST_POINTS = 100


def teacher_figure(scans: Sequence[AnswersOfScan], title: str) -> Figure:
    """Shares of rain and of unknown points in a teacher's labels, by scan and by range.

    Args:
        scans: The scans, in time order, one or more.
        title: Heading.
    """
    figure = scan_pictures.titled_figure(12, 4.6, title)
    by_scan, by_range = figure.subplots(1, 2, width_ratios=(3, 2))
    _draw_by_scan(by_scan, scans)
    bands = coarse_bands(sum((scan.answers for scan in scans), Answers()))
    filled = {name: answers for name, answers in bands.items() if answers.points}
    _draw_shares(by_range, np.arange(len(filled)), list(filled.values()), width=0.8)
    by_range.set_xticks(range(len(filled)), list(filled))
    by_range.set_title("by range, all scans", fontsize=10)
    legend = {"ncols": len(TEACHERS_ANSWERS), "title": "the rest: not rain"}
    scan_pictures.legend_below(figure, by_range.containers, **legend)
    return figure


def removed_figure(held_out: Answers, title: str) -> Figure:
    """Share removed from the held-out scans by range, beside the teacher's labels.

    Args:
        held_out: The answers of all held-out scans.
        title: Heading.
    """
    figure = Figure(figsize=(9, 4.6), layout="constrained")
    axes = figure.add_subplot()
    axes.set_title(title)
    points = held_out.table.sum(axis=(1, 2))
    answers = held_out.table.sum(axis=2)
    drawn = points >= FEWEST_POINTS
    perhaps = answers[:, RAIN] + answers[:, NOT_KNOWN]
    counted = np.stack([answers[:, RAIN], perhaps, held_out.table[..., 1].sum(axis=1)])
    rain, perhaps, student = np.where(drawn, ratio(counted, points), np.nan)
    stairs = partial(axes.stairs, edges=[*FINE_EDGES, LAST_EDGE])
    stairs(rain, fill=True, color=OF_ANSWERS[RAIN], alpha=0.35)
    unsure = stairs(perhaps, baseline=rain, fill=True, color=OF_ANSWERS[NOT_KNOWN], alpha=0.45)
    unsure.set_label("teacher: not known")
    stairs(rain, baseline=None, color=OF_ANSWERS[RAIN], linewidth=1.5, label="teacher: rain")
    stairs(student, baseline=None, color=STUDENT, linewidth=2.2, label="student: removed")
    axes.set_xlabel(f"range / m (the last band: {FINE_EDGES[-1]} m and more)")
    axes.set_ylabel("share of the points at that range")
    axes.set_xlim(0, LAST_EDGE)
    _scale(axes, float(np.nanmax(np.fmax(student, rain), initial=0)))
    axes.legend(frameon=False)
    return figure


def answers_figure(scan: Scan, card: DataCard, called_rain: Bools, title: str) -> Figure:
    """A scan from above by its teacher's labels, by its student, and where they differ.

    Args:
        scan: A scan with the teacher's labels.
        card: Data card of these labels.
        called_rain: The student's rain, bool (N,).
        title: Heading.

    Raises:
        InputError: A scan without labels.
    """
    answer = answer_of(scan, card)
    lost, left = called_rain & (answer == NOT_RAIN), ~called_rain & (answer == RAIN)
    differs = np.select([lost, left], [LOST, LEFT], default=KEPT)
    panels = {
        "teacher": np.choose(answer, [KEPT, REMOVED, LEFT]),
        "student": np.where(called_rain, REMOVED, KEPT),
        "where they differ": differs,
    }
    meanings = {
        "rain": REMOVED,
        "not known to the teacher, or rain to it alone": LEFT,
        "rain to the student alone": LOST,
    }
    figure = scan_pictures.titled_figure(16, 5.7, title)
    row = figure.subplots(1, 3, sharex=True, sharey=True)
    for axes, (name, outcome) in zip(row, panels.items(), strict=True):
        axes.set_title(name)
        scan_pictures.draw_from_above(axes, scan, outcome)
        axes.set_xlabel("right / m")
    half = _reach(scan, called_rain | (answer == RAIN))
    row[0].set(xlim=(-1.2 * half, 1.2 * half), ylim=(-half, half))
    row[0].set_ylabel("forward / m")
    colours = list(OUTCOMES.values())
    explained = {name: colours[number] for name, number in meanings.items()}
    scan_pictures.explain_colours(figure, explained)
    return figure


def _reach(scan: Scan, rain: Bools) -> float:
    """Half the height of a picture that shows most of the rain, metres."""
    ranges = scan.range[rain & scan.valid]
    return max(LEAST_REACH, 1.3 * float(np.percentile(ranges, 95))) if len(ranges) else FAR


def _draw_by_scan(axes: Axes, scans: Sequence[AnswersOfScan]) -> None:
    """Bars in time order; a line marks the first held-out scan."""
    _draw_shares(axes, np.arange(len(scans)), [scan.answers for scan in scans], width=1.0)
    held_out = [place for place, scan in enumerate(scans) if scan.held_out]
    if held_out:
        start = held_out[0] - 0.5
        axes.axvline(start, color=STUDENT, linestyle=":")
        at_top = axes.get_xaxis_transform()
        axes.text(start, 0.99, " held out", transform=at_top, color=STUDENT, va="top", fontsize=9)
    axes.set_xlim(-0.5, len(scans) - 0.5)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("scan, in time order")
    axes.set_ylabel("share of the points")
    axes.set_title("by scan", fontsize=10)


def _draw_shares(axes: Axes, places: Ints, answers: Sequence[Answers], width: float) -> None:
    """Stacked bars: rain, and above it what is not known; the rest is not rain."""
    shares = np.array([one.shares for one in answers]).reshape(-1, len(TEACHERS_ANSWERS))
    shares = np.nan_to_num(shares)  # no bar where there are no points
    bottom = np.zeros(len(answers))
    for answer in (RAIN, NOT_KNOWN):
        share, colour, name = shares[:, answer], OF_ANSWERS[answer], TEACHERS_ANSWERS[answer]
        axes.bar(places, share, width, bottom, color=colour, label=name)
        bottom = bottom + share
    _scale(axes, float(bottom.max(initial=0)))


def _scale(axes: Axes, largest: float) -> None:
    """Scales an axis of shares, in per cent, from 0 to a little above the largest."""
    axes.set_ylim(0, min(1.0, max(1.15 * largest, LEAST_TOP)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda share, _: f"{100 * share:.3g} %"))
    axes.spines[["top", "right"]].set_visible(False)
