"""Points by truth, by answer and by band of range, and the scores that follow from them."""

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

SCORES = ("precision", "recall", "f1", "iou")

# Where the bands of range start, metres; the last band is open.
RANGE_EDGES = (0, 10, 20, 40, 80)


def ratio(part: ArrayLike, whole: ArrayLike) -> NDArray[np.float64]:
    """Share of each part in its whole, float64, of their broadcast shape; NaN for a whole of 0.

    Args:
        part: Numbers, or one.
        whole: Numbers, or one.
    """
    part, whole = np.broadcast_arrays(part, whole)
    shares = np.full(whole.shape, np.nan)
    np.divide(part, whole, out=shares, where=whole != 0)
    return shares


def intersection_over_union(hits: ArrayLike, errors: ArrayLike) -> NDArray[np.float64]:
    """IoU of rain, float64, of their broadcast shape; NaN where no point is rain or called rain.

    Args:
        hits: Points of rain called rain, one number or several.
        errors: Rain not called rain and other points called rain, together.
    """
    return ratio(hits, np.add(hits, errors))


def table_of(cells: Sequence[NDArray[np.integer]], shape: tuple[int, ...]) -> NDArray[np.int64]:
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


def band_of(range: NDArray[np.floating], edges: Sequence[float] = RANGE_EDGES) -> NDArray[np.int64]:
    """Number of each point's band, int64 (N,).

    Args:
        range: Distance from the sensor, metres, (N,). Values that are not finite belong to the
            last band.
        edges: Where the bands start, metres, rising from 0.
    """
    finite_or_far = np.where(np.isfinite(range), range, np.inf)
    return np.searchsorted(edges[1:], finite_or_far, side="right").astype(np.int64)


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
    def of(cls, called_rain: NDArray[np.bool_], rain: NDArray[np.bool_]) -> "Counts":
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
