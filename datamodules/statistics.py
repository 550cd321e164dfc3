"""Statistics of training scans: what a network's input is normalised by."""

from collections.abc import Iterable, Sequence
from typing import TypeVar

import numpy as np

from derain.cards import DataCard
from derain.scan import Scan

Item = TypeVar("Item")


def evenly_spaced(items: Sequence[Item], most: int) -> list[Item]:
    """At most so many items, spread over the whole sequence."""
    numbers = np.linspace(0, len(items) - 1, min(most, len(items))).round().astype(int)
    return [items[number] for number in numbers]


def measured(card: DataCard, scans: Iterable[Scan]) -> DataCard:
    """Completes a data card with the statistics that it lacks.

    Mean and standard deviation of x, y, z and range in metres and of intensity, and the share of
    rain, over the valid points of all scans. Scans without intensity, or without points, count as
    0. The share of rain is not measured where a scan has no labels.

    Args:
        card: A data card.
        scans: Training scans.
    """
    count, rain, labelled = 0, 0, True
    total, squares = np.zeros(5), np.zeros(5)
    for scan in scans:
        valid = scan.valid
        intensity = np.zeros(len(scan)) if scan.intensity is None else scan.intensity
        points = np.column_stack([scan.xyz, intensity, scan.range])[valid].astype(np.float64)
        count += len(points)
        total += points.sum(axis=0)
        squares += (points**2).sum(axis=0)
        labelled = labelled and scan.label is not None
        rain += int(card.rain_of(scan)[valid].sum()) if labelled else 0
    mean = total / max(count, 1)
    variance = np.maximum(squares / max(count, 1) - mean**2, 0)
    # A channel that never changes says nothing, and is not to be divided by 0.
    std = np.where(variance > 0, np.sqrt(variance), 1.0)
    return card.completed(
        mean=tuple(mean[:4].tolist()),
        std=tuple(std[:4].tolist()),
        range=(float(mean[4]), float(std[4])),
        rain_share=rain / max(count, 1) if labelled else None,
    )
