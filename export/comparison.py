"""Methods side by side: error and milliseconds on the same scans."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from derain.cards import DataCard
from derain.metrics import SCORES, Counts, RainMetrics
from derain.scan import Scan
from derain.stopwatch import Stopwatch

STAGES = ("read", "view", "network", "back")

# Judges a scan, bool (N,), and gives the stopwatch its stages.
Method = Callable[[Scan, Stopwatch], NDArray[np.bool_]]


@dataclass(frozen=True)
class Row:
    """How one method did.

    Attributes:
        method: Its name.
        counts: Points of all scans.
        milliseconds: Median time of a scan, by stage.
    """

    method: str
    counts: Counts
    milliseconds: Mapping[str, float]


def compare(
    methods: Mapping[str, Method],
    scans: Sequence[Path],
    read: Callable[[Path], Scan],
    card: DataCard,
) -> list[Row]:
    """Runs every method on every scan.

    Args:
        methods: Methods by name.
        scans: Files of the scans.
        read: Reads one of them, with its labels.
        card: Data card that says which labels are rain.
    """
    return [_run(name, method, scans, read, card) for name, method in methods.items()]


def as_table(rows: Sequence[Row]) -> str:
    """The comparison as a Markdown table."""
    head = ["method", *("P", "R", "F1", "IoU"), *(f"{stage} ms" for stage in STAGES), "total ms"]
    body = [
        [
            row.method,
            *(f"{getattr(row.counts, score):.3f}" for score in SCORES),
            *(f"{row.milliseconds.get(stage, 0):.1f}" for stage in STAGES),
            f"{sum(row.milliseconds.values()):.1f}",
        ]
        for row in rows
    ]
    widths = [max(map(len, column)) for column in zip(head, *body, strict=True)]
    lines = [_line(cells, widths) for cells in (head, *body)]
    rule = "|".join(["", "-" * (widths[0] + 2), *("-" * (w + 1) + ":" for w in widths[1:]), ""])
    return "\n".join([lines[0], rule, *lines[1:]])


def _run(
    name: str,
    method: Method,
    scans: Sequence[Path],
    read: Callable[[Path], Scan],
    card: DataCard,
) -> Row:
    metrics = RainMetrics(card.classes, card.rain)
    stopwatches = []
    for path in scans:
        stopwatch = Stopwatch()
        with stopwatch.stage("read"):
            scan = read(path)
        predicted = method(scan, stopwatch)
        stopwatches.append(stopwatch)
        metrics.update(
            predicted=torch.from_numpy(predicted),
            label=torch.from_numpy(scan.label),
            range=torch.from_numpy(scan.range),
            scan=torch.zeros(len(scan), dtype=torch.int64),
            scans=1,
        )
    stages = stopwatches[0].milliseconds
    median = {
        stage: float(np.median([stopwatch.milliseconds[stage] for stopwatch in stopwatches]))
        for stage in stages
    }
    return Row(name, metrics.pooled(), median)


def _line(cells: Sequence[str], widths: Sequence[int]) -> str:
    first, *others = (
        cell.ljust(width) if number == 0 else cell.rjust(width)
        for number, (cell, width) in enumerate(zip(cells, widths, strict=True))
    )
    return " | ".join([f"| {first}", *others]) + " |"
