"""Statistics of training scans: what a network's input is normalised by."""

from collections.abc import Iterable, Sequence
from typing import TypeVar

import numpy as np

from derain.cards import DataCard
from derain.scan import Scan

Item = TypeVar("Item")


def evenly_spaced(items: Sequence[Item], most: int = 200) -> list[Item]:
    """At most so many items, spread over the whole sequence."""
    numbers = np.linspace(0, len(items) - 1, min(most, len(items))).round().astype(int)
    return [items[number] for number in numbers]


def measured(card: DataCard, scans: Iterable[Scan]) -> DataCard:
    """Completes a data card with the statistics of labelled scans.

    Mean and standard deviation of x, y, z in metres and of intensity, and the share of rain, over
    the valid points of all scans. Scans without intensity, or without points, count as 0.

    Args:
        card: A data card.
        scans: Labelled scans.
    """
    count, rain = 0, 0
    total, squares = np.zeros(4), np.zeros(4)
    for scan in scans:
        valid = scan.valid
        intensity = np.zeros(len(scan)) if scan.intensity is None else scan.intensity
        points = np.column_stack([scan.xyz, intensity])[valid].astype(np.float64)
        count += len(points)
        total += points.sum(axis=0)
        squares += (points**2).sum(axis=0)
        rain += int(card.rain_of(scan)[valid].sum())
    mean = total / max(count, 1)
    variance = np.maximum(squares / max(count, 1) - mean**2, 0)
    # A channel that never changes says nothing, and is not to be divided by 0.
    std = np.where(variance > 0, np.sqrt(variance), 1.0)
    return card.with_statistics(tuple(mean.tolist()), tuple(std.tolist()), rain / max(count, 1))
