"""How good methods are: counted over the points of all scans, and over many a part of them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from derain.cards.card import DataCard
from derain.evaluation.counts import Counts
from derain.evaluation.metrics import ClassCounts, RainMetrics
from derain.export.bench.contestants import Contestant, Method
from derain.filters import PointFilter
from derain.filters.derainer import filter_view
from derain.scan import Scan
from derain.system.stopwatch import Stopwatch
from derain.views.morton import first_rows


@dataclass(frozen=True)
class Scores:
    """What became of the points of all scans.

    Attributes:
        pooled: All points together.
        per_scan: Those of each scan, in order.
        by_class: Each semantic class, by name.
        by_range: Each band of ranges, by names such as ``0-10 m``.
        by_rain_rate: Scans of one rain rate, by names such as ``25 mm/h``; empty where none is
            known.
        by_sensor: Points of the LiDAR and of the radar; empty where it is not known whose they are.
        failures: What went wrong, by the scan's name. Such a scan counts as one in which the method
            found nothing: it stays as it came.
    """

    pooled: Counts
    per_scan: Sequence[Counts]
    by_class: Mapping[str, ClassCounts]
    by_range: Mapping[str, Counts]
    by_rain_rate: Mapping[str, Counts]
    by_sensor: Mapping[str, Counts]
    failures: Mapping[str, str]


@dataclass(frozen=True)
class Labelled:
    """Labelled scans, ready to be judged.

    Attributes:
        card: Says which labels are rain.
        scans: Files of the scans.
        read: Reads one of them, with its labels.
        rain_rate: Rain rate of each scan in mm/h, as far as it is known.
        distinct: Count points at one position once.
    """

    card: DataCard
    scans: Sequence[Path]
    read: Callable[[Path], Scan]
    rain_rate: Mapping[Path, float] = field(default_factory=dict)
    distinct: bool = False


def score(rows: Sequence[Contestant], data: Labelled, threads: int) -> list[Scores]:
    """Judges every scan by every method; filters share one search for neighbours.

    Args:
        rows: The methods.
        data: The scans.
        threads: Threads of views and networks; 0 takes every core this process may use.

    Raises:
        InputError: A scan that cannot be read. A method that fails is noted in its scores.
    """
    shared = _SharedView([row.filter for row in rows if row.filter], threads)
    methods: list[Method] = [
        partial(shared, row.filter) if row.filter else row.ready(threads) for row in rows
    ]
    tallies = [_Tally(data.card) for _ in rows]
    for path in tqdm(data.scans, desc="scoring", unit="scan", disable=None):
        scan = data.read(path)
        counted = first_rows(scan) if data.distinct else np.arange(len(scan))
        for method, tally in zip(methods, tallies, strict=True):
            tally.update(method, scan, counted)
    rates = [data.rain_rate.get(path) for path in data.scans]
    return [tally.scores(rates) for tally in tallies]


class _SharedView:
    """One search for neighbours a scan, for as many as the most demanding filter looks at."""

    def __init__(self, filters: Sequence[PointFilter], threads: int) -> None:
        most = max((filter.neighbours for filter in filters), default=0)
        self.view = filter_view(most, threads)
        self.scan: Scan | None = None

    def __call__(self, filter: PointFilter, scan: Scan, stopwatch: Stopwatch) -> NDArray[np.bool_]:
        if scan is not self.scan:
            self.scan, self.seen = scan, self.view(scan)
        return self.seen.back(filter.judge(self.seen).astype(np.float32)) > 0


class _Tally:
    """Counts what one method makes of the scans."""

    def __init__(self, card: DataCard) -> None:
        self.card = card
        self.metrics = RainMetrics(card.classes, card.rain, unknown=card.unknown)
        self.by_sensor: dict[str, list[Counts]] = {}
        self.failures: dict[str, str] = {}

    def update(self, method: Method, scan: Scan, counted: NDArray[np.int64]) -> None:
        """Judges a whole scan, and counts some of its rows."""
        try:
            predicted = method(scan, Stopwatch())
        except Exception as error:  # whatever its libraries raise is told in the method's row
            self.failures[scan.name] = str(error)
            predicted = np.zeros(len(scan), bool)
        scan, predicted = scan.take(counted), predicted[counted]
        self.metrics.update_scan(scan, predicted)
        if scan.radar is not None:
            rain, known = self.card.rain_of(scan), ~self.card.unknown_of(scan)
            for sensor, points in {"LiDAR": ~scan.radar, "radar": scan.radar}.items():
                rows = known & points
                self.by_sensor.setdefault(sensor, []).append(Counts.of(predicted[rows], rain[rows]))

    def scores(self, rain_rates: Sequence[float | None]) -> Scores:
        """The counts so far, given the rain rate of each scan in mm/h."""
        per_scan = self.metrics.per_scan()
        by_rate: dict[float, list[Counts]] = {}
        for rate, counts in zip(rain_rates, per_scan, strict=True):
            if rate is not None:
                by_rate.setdefault(rate, []).append(counts)
        return Scores(
            self.metrics.pooled(),
            per_scan,
            self.metrics.by_class(),
            self.metrics.by_range(),
            {f"{rate:g} mm/h": sum(by_rate[rate], Counts()) for rate in sorted(by_rate)},
            {sensor: sum(parts, Counts()) for sensor, parts in self.by_sensor.items()},
            self.failures,
        )
