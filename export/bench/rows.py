"""Rows of the bench's table: scores and cost of each method, and how sure the scores are."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from derain.evaluation.counts import (
    SCORES,
    Counts,
    intersection_over_union,
    mean_over_scans,
    or_none,
)
from derain.evaluation.scores import Scores
from derain.export.bench.bench_entries import BenchEntry
from derain.export.bench.cost import Cost
from derain.export.timing import STAGES
from derain.scan import Floats, Ints

DRAWS = 2000
CONFIDENCE = 0.95

Interval = tuple[float, float]


@dataclass(frozen=True)
class Row:
    """The results of one method.

    Attributes:
        bench_entry: The method.
        scores: Its scores.
        cost: Its cost.
        iou_interval: 95 % interval of its IoU over scans; None for fewer than two scans, and where
            the IoU is undefined.
        behind_best: 95 % interval of the best method's IoU minus its own.
    """

    bench_entry: BenchEntry
    scores: Scores
    cost: Cost
    iou_interval: Interval | None
    behind_best: Interval | None

    @property
    def title(self) -> str:
        """The method's title."""
        return self.bench_entry.title

    @property
    def kind(self) -> str:
        """Name of its network, filter or baseline."""
        return self.bench_entry.kind

    @property
    def milliseconds(self) -> float:
        """Median time from file to mask; NaN where the method could not be timed."""
        return self.cost.times.percentile(50)

    def as_dict(self) -> dict[str, Any]:
        """The row as JSON-able primitives; None for undefined or unknown values."""
        scores, times = self.scores, self.cost.times
        return {
            "method": self.title,
            "kind": self.kind,
            **_scores(scores.pooled),
            **{
                f"{name}_per_scan": or_none(mean_over_scans(scores.per_scan, name))
                for name in SCORES
            },
            "iou_interval": self.iou_interval,
            "iou_behind_best_interval": self.behind_best,
            "ms": or_none(self.milliseconds),
            "ms_p95": or_none(times.percentile(95)),
            "stages": {
                stage: {f"p{p}": or_none(times.percentile(p, stage)) for p in (50, 95)}
                for stage in STAGES
            },
            "peak_memory_mib": self.cost.peak_memory,
            "counts": asdict(scores.pooled),
            "by_class": {name: asdict(c) for name, c in scores.by_class.items() if c.points},
            "by_range": _all_scores(scores.by_range),
            "by_rain_rate": _all_scores(scores.by_rain_rate),
            "by_sensor": _all_scores(scores.by_sensor),
            "failed_scans": dict(scores.failures),
            "not_timed": self.cost.failure,
            **self.bench_entry.facts,
        }


def bench_rows(
    bench_entries: Sequence[BenchEntry],
    scores: Sequence[Scores],
    costs: Sequence[Cost],
    generator: np.random.Generator,
) -> list[Row]:
    """The rows, in the order of the methods.

    Args:
        bench_entries: The methods, one or more.
        scores: The scores of each, on the same scans.
        costs: The cost of each.
        generator: Draws scans for the intervals.
    """
    per_scan = [row.per_scan for row in scores]
    found = np.array([[c.true_positive for c in scans] for scans in per_scan])
    errors = np.array([[c.false_positive + c.false_negative for c in scans] for scans in per_scan])
    intervals = bootstrap(found, errors, generator)
    return [Row(*row) for row in zip(bench_entries, scores, costs, *intervals, strict=True)]


def _scores(counts: Counts) -> dict[str, float | None]:
    return {name: or_none(getattr(counts, name)) for name in SCORES}


def _all_scores(groups: Mapping[str, Counts]) -> dict[str, dict[str, float | None]]:
    return {name: {**_scores(counts), **asdict(counts)} for name, counts in groups.items()}


def bootstrap(
    found: Ints, errors: Ints, generator: np.random.Generator
) -> tuple[list[Interval | None], list[Interval | None]]:
    """95 % intervals of every method's pooled IoU, and of what it is behind the best method's.

    Draws as many scans as there are, with replacement, ``DRAWS`` times.

    Every method is scored on the same draws: a hard scan lowers the IoU of all of them and hardly
    changes the difference between two. Consecutive scans of a sequence are alike, so that intervals
    over few sequences are too narrow. Draws without an IoU are left out.

    Args:
        found: Rain called rain, by method and scan, int64 (methods, scans).
        errors: False positives and false negatives together, of the same shape.
        generator: Draws the scans.

    Returns:
        The interval of each method's IoU, None where no draw has an IoU; and that of the best
        method's IoU minus each method's, on the same draws. Where the latter contains 0, these
        scans do not show which of the two is better. It is None where no draw has an IoU of both.
        All are None for fewer than two scans, which do not show how much scans differ.

    Source: B. Efron, "Bootstrap Methods: Another Look at the Jackknife", Annals of Statistics,
        1979; percentile intervals.
    """
    methods, scans = found.shape
    if scans < 2:
        nothing: list[Interval | None] = [None] * methods
        return nothing, nothing
    # How often each scan is drawn.
    times = generator.multinomial(scans, np.full(scans, 1 / scans), DRAWS)
    iou = intersection_over_union(found @ times.T, errors @ times.T)
    pooled = intersection_over_union(found.sum(axis=1), errors.sum(axis=1))
    best = np.argmax(np.nan_to_num(pooled, nan=-1))
    return _intervals(iou), _intervals(iou[best] - iou)


def _intervals(draws: Floats) -> list[Interval | None]:
    return [_interval(each[~np.isnan(each)]) for each in draws]


def _interval(draws: Floats) -> Interval | None:
    if not len(draws):
        return None
    tail = 50 * (1 - CONFIDENCE)
    low, high = np.percentile(draws, [tail, 100 - tail]).tolist()
    return low, high
