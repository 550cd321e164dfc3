"""Points by truth, answer, class and band of range, and the scores that follow from them."""

import math
from collections.abc import Collection, Sequence
from dataclasses import astuple, dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from derain.cards.card import DataCard
from derain.errors import InputError
from derain.scan import Bools, Floats, Ints, Scan

SCORES = ("precision", "recall", "f1", "iou")

# Where the bands of range start, metres; the last band is open.
RANGE_EDGES = (0, 10, 20, 40, 80)


def ratio(part: ArrayLike, whole: ArrayLike) -> Floats:
    """Share of each part in its whole, float64, of their broadcast shape; NaN for a whole of 0.

    Args:
        part: Numbers, or one.
        whole: Numbers, or one.
    """
    part, whole = np.broadcast_arrays(part, whole)
    shares = np.full(whole.shape, np.nan)
    np.divide(part, whole, out=shares, where=whole != 0)
    return shares


def intersection_over_union(hits: ArrayLike, errors: ArrayLike) -> Floats:
    """IoU of rain, float64, of their broadcast shape; NaN where no point is rain or called rain.

    Args:
        hits: Points of rain called rain, one number or several.
        errors: Rain not called rain and other points called rain, together.
    """
    return ratio(hits, np.add(hits, errors))


def table_of(cells: Sequence[NDArray[np.integer]], shape: tuple[int, ...]) -> Ints:
    """Number of points in each cell of a table, int64 of its shape.

    Args:
        cells: Place of each point along each axis of the table, whole numbers (N,) each.
        shape: Shape of the table.
    """
    places = np.ravel_multi_index(tuple(cells), shape)
    return np.bincount(places, minlength=math.prod(shape)).reshape(shape)


def band_names() -> list[str]:
    """Names of the bands of ``RANGE_EDGES``, such as ``0-10 m`` and, for the last, ``80+ m``."""
    names = [f"{start}-{end} m" for start, end in pairwise(RANGE_EDGES)]
    return [*names, f"{RANGE_EDGES[-1]}+ m"]


def band_of(range: NDArray[np.floating]) -> Ints:
    """Number of each point's band of ``RANGE_EDGES``, int64 (N,).

    Args:
        range: Distance from the sensor, metres, (N,). Values that are not finite belong to the
            last band.
    """
    finite_or_far = np.where(np.isfinite(range), range, np.inf)
    return np.searchsorted(RANGE_EDGES[1:], finite_or_far, side="right").astype(np.int64)


@dataclass(frozen=True)
class Counts:
    """Points by truth and by answer; rain is the positive class.

    A score whose denominator is zero is undefined: it is NaN. A scan without rain has no recall; if
    no point of it is called rain either, it has no score at all, and one point falsely called rain
    gives it a precision, an F1 and an IoU of 0.

    Attributes:
        true_positive: Rain called rain.
        false_positive: Other points called rain.
        false_negative: Rain not called rain.
        true_negative: Other points not called rain.
    """

    true_positive: int = 0
    false_positive: int = 0
    false_negative: int = 0
    true_negative: int = 0

    @classmethod
    def of(cls, called_rain: Bools, rain: Bools) -> "Counts":
        """Counts points.

        Args:
            called_rain: Points called rain, bool (N,).
            rain: Points that are rain, bool (N,).
        """
        called, wet = int(np.count_nonzero(called_rain)), int(np.count_nonzero(rain))
        hits = int(np.count_nonzero(called_rain & rain))
        return cls(hits, called - hits, wet - hits, len(rain) - called - wet + hits)

    def __add__(self, other: "Counts") -> "Counts":
        """Counts of the points of both."""
        return Counts(*(a + b for a, b in zip(astuple(self), astuple(other), strict=True)))

    @property
    def precision(self) -> float:
        """Share of rain among the points called rain; NaN where none was."""
        return float(ratio(self.true_positive, self.true_positive + self.false_positive))

    @property
    def recall(self) -> float:
        """Share of the rain that was called rain; NaN where there is none."""
        return float(ratio(self.true_positive, self.true_positive + self.false_negative))

    @property
    def f1(self) -> float:
        """Harmonic mean of precision and recall; NaN where no point is rain or called rain."""
        errors = self.false_positive + self.false_negative
        return float(ratio(2 * self.true_positive, 2 * self.true_positive + errors))

    @property
    def iou(self) -> float:
        """Intersection over union of rain; NaN where no point is rain or called rain."""
        errors = self.false_positive + self.false_negative
        return float(intersection_over_union(self.true_positive, errors))


def mean_over_scans(per_scan: Sequence[Counts], score: str) -> float:
    """Mean of the scores of the scans that have it; NaN where none has.

    Args:
        per_scan: Counts of each scan.
        score: One of ``SCORES``.
    """
    scores = np.array([getattr(counts, score) for counts in per_scan])
    defined = scores[~np.isnan(scores)]
    return float(defined.mean()) if len(defined) else math.nan


def or_none(score: float) -> float | None:
    """The score, and None in place of NaN, which JSON does not have."""
    return None if math.isnan(score) else score


@dataclass(frozen=True)
class ClassCounts:
    """Points of one semantic class, and those of them called rain.

    Attributes:
        points: Points of the class.
        called_rain: Those called rain.
        rain: True if the class counts as rain.
    """

    points: int
    called_rain: int
    rain: bool

    @property
    def share_lost(self) -> float:
        """Share of the class called rain: its recall if it is rain, else its false positives.

        It is NaN for a class without points.
        """
        return float(ratio(self.called_rain, self.points))

    @property
    def wrong(self) -> int:
        """Points judged wrongly: rain that is kept, or other points that are called rain."""
        return self.points - self.called_rain if self.rain else self.called_rain

    @property
    def share_wrong(self) -> float:
        """Share of the class judged wrongly; NaN for a class without points."""
        return float(ratio(self.wrong, self.points))

    def __add__(self, other: "ClassCounts") -> "ClassCounts":
        """Counts of the points of two classes, or of two parts of one."""
        called_rain = self.called_rain + other.called_rain
        return ClassCounts(self.points + other.points, called_rain, self.rain)


class RainCounts:
    """Counts of one method's answers, by scan, class and range.

    :class:`~derain.evaluation.metrics.RainMetrics` adds them up across processes during training.

    Args:
        card: Data card of the scans. Points of a class that it calls unknown are left out.

    Attributes:
        cells: Points by class, by band of range and by whether they are called rain, int64
            (classes, bands, 2).
        per_scan: Counts of each scan, in the order in which they were added.
    """

    def __init__(self, card: DataCard) -> None:
        self.card = card
        classes = {id_: name for id_, name in card.classes.items() if id_ not in card.unknown}
        self.ids = np.array(sorted(classes), np.int64)
        self.names = [classes[id_] for id_ in self.ids.tolist()]
        self.is_rain = np.isin(self.ids, card.rain)
        self.cells = np.zeros((len(self.ids), len(RANGE_EDGES), 2), np.int64)
        self.per_scan: list[Counts] = []

    def add(self, scan: Scan, called_rain: Bools) -> None:
        """Counts the points of one labelled scan.

        Args:
            scan: A scan of N points, with labels. A range that is not finite belongs to the last
                band.
            called_rain: True for the points called rain, bool (N,).

        Raises:
            InputError: A scan without labels, or a label that is no class.
        """
        known = ~self.card.unknown_of(scan)
        assert scan.label is not None  # the line above refuses a scan without labels
        row, band = self._class_rows(scan.label[known]), band_of(scan.range[known])
        self.add_cells(table_of((row, band, called_rain[known].astype(np.int64)), self.cells.shape))

    def add_cells(self, cells: Ints) -> None:
        """Adds the points of one scan that are counted already.

        Args:
            cells: Of the shape of :attr:`cells`.
        """
        self.cells += cells
        self.per_scan.append(self._counts(cells))

    @property
    def pooled(self) -> Counts:
        """Counts over the points of all scans."""
        return self._counts(self.cells)

    def pooled_over(self, ids: Collection[int]) -> Counts:
        """Counts over the points of some classes, such as those of one of several data sets."""
        return self._counts(self.cells * np.isin(self.ids, [*ids])[:, None, None])

    @property
    def by_class(self) -> dict[str, ClassCounts]:
        """Counts of each semantic class, by name."""
        bands = self.by_class_and_range().items()
        return {name: sum(others, first) for name, (first, *others) in bands}

    @property
    def by_range(self) -> dict[str, Counts]:
        """Counts of each band of range, by ``band_names``."""
        names = enumerate(band_names())
        return {name: self._counts(self.cells[:, band : band + 1]) for band, name in names}

    def by_class_and_range(self) -> dict[str, list[ClassCounts]]:
        """Counts of each semantic class, by name, in each band of ``band_names``."""
        rows = zip(self.names, self.is_rain.tolist(), self.cells.tolist(), strict=True)
        return {
            name: [ClassCounts(kept + called, called, rain) for kept, called in bands]
            for name, rain, bands in rows
        }

    def _class_rows(self, label: Ints) -> Ints:
        strange = label[~np.isin(label, self.ids)]
        if len(strange):
            raise InputError(
                "labels",
                f"id {int(strange[0])} is no known class",
                "Name it among the data card's classes.",
            )
        return np.searchsorted(self.ids, label).astype(np.int64)

    def _counts(self, cells: Ints) -> Counts:
        """Adds up the points of some cells, int64 (classes, any bands, 2)."""
        false_negative, true_positive = cells[self.is_rain].sum(axis=(0, 1)).tolist()
        true_negative, false_positive = cells[~self.is_rain].sum(axis=(0, 1)).tolist()
        return Counts(true_positive, false_positive, false_negative, true_negative)
