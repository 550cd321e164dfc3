"""Scores of methods: over the points of all scans, and by scan, class, range and rain rate."""

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import astuple
from itertools import repeat
from typing import Any

import numpy as np

from derain.cards.card import DataCard
from derain.errors import reason_of
from derain.evaluation.counts import Counts, RainCounts
from derain.scan import Bools, Ints, Scan
from derain.views.morton import first_rows

# Returns which points of a scan are rain, bool (N,).
ScoredMethod = Callable[[Scan], Bools]


class Scores(RainCounts):
    """Counts of the answers of one method, scan after scan, also by rain rate and by sensor.

    Args:
        card: Data card of the scans.

    Attributes:
        by_sensor: Points of the LiDAR and of the radar; empty where they are not distinguished.
        failures: Errors, by the scan's name. In such a scan, no point counts as called rain.
    """

    def __init__(self, card: DataCard) -> None:
        super().__init__(card)
        self.by_sensor: defaultdict[str, Counts] = defaultdict(Counts)
        self.failures: dict[str, str] = {}
        self._by_rate: defaultdict[float, Counts] = defaultdict(Counts)

    @property
    def by_rain_rate(self) -> Mapping[str, Counts]:
        """Scans of one rain rate, by names such as ``25 mm/h``; empty where none is known."""
        return {f"{rate:g} mm/h": counts for rate, counts in sorted(self._by_rate.items())}

    def judge(self, method: ScoredMethod, scan: Scan, counted: Ints, rate: float | None) -> None:
        """Judges a whole scan, and counts some of its rows."""
        try:
            predicted = method(scan)
        except Exception as error:  # its row states whatever a library raises
            self.failures[scan.name] = reason_of(error)
            predicted = np.zeros(len(scan), bool)
        scan, predicted = scan.take(counted), predicted[counted]
        self.add(scan, predicted)
        if rate is not None:
            self._by_rate[rate] += self.per_scan[-1]
        if scan.radar is not None:
            rain, known = self.card.rain_of(scan), ~self.card.unknown_of(scan)
            for sensor, points in {"LiDAR": ~scan.radar, "radar": scan.radar}.items():
                rows = known & points
                self.by_sensor[sensor] += Counts.of(predicted[rows], rain[rows])

    def to_json(self) -> dict[str, Any]:
        """The counts so far, as :meth:`add_json` takes them."""
        return {
            "cells": self.cells.tolist(),
            "per_scan": [astuple(counts) for counts in self.per_scan],
            "by_rain_rate": [[rate, *astuple(each)] for rate, each in self._by_rate.items()],
            "by_sensor": [[sensor, *astuple(each)] for sensor, each in self.by_sensor.items()],
            "failures": self.failures,
        }

    def add_json(self, later: Mapping[str, Any]) -> None:
        """Adds the counts of later scans, which may come from another process."""
        self.cells += np.array(later["cells"], np.int64)
        self.per_scan += [Counts(*counts) for counts in later["per_scan"]]
        for rate, *counts in later["by_rain_rate"]:
            self._by_rate[rate] += Counts(*counts)
        for sensor, *counts in later["by_sensor"]:
            self.by_sensor[sensor] += Counts(*counts)
        self.failures |= later["failures"]


def score(
    methods: Sequence[ScoredMethod],
    scans: Iterable[Scan],
    card: DataCard,
    distinct: bool = False,
    rain_rates: Sequence[float | None] | None = None,
) -> list[Scores]:
    """Judges every scan by every method.

    Args:
        methods: The methods.
        scans: Labelled scans. One is in memory at a time, if each is read when its turn comes.
        card: Their data card.
        distinct: Count points at one position once.
        rain_rates: Rain rate of each scan in mm/h, None where it is not known; None for all scans.

    Returns:
        The scores of each method, in the order of the methods.

    Raises:
        InputError: A scan that cannot be read, one without labels, or a label that is no class of
            the card. A method that fails is noted in its scores.
    """
    scores = [Scores(card) for _ in methods]
    for scan, rate in zip(scans, repeat(None) if rain_rates is None else rain_rates, strict=False):
        counted = first_rows(scan) if distinct else np.arange(len(scan))
        for method, of_method in zip(methods, scores, strict=True):
            of_method.judge(method, scan, counted, rate)
    return scores
