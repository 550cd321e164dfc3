"""Precision and recall at many thresholds at once."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torchmetrics import Metric

from derain.evaluation.counts import Counts, intersection_over_union, ratio, table_of
from derain.scan import Bools, Float32s, Floats, Ints

# Thresholds from 0 to 1 in equal steps; TensorBoard's curves take no more than 127.
CURVE_THRESHOLDS = np.linspace(0, 1, 101)

# Denser thresholds near 0 and 1, where confident networks put most points.
CLOSE = np.array([digit * 10.0**-power for power in (6, 5, 4, 3) for digit in (1, 2, 5)])


@dataclass(frozen=True, eq=False)
class OperatingPoints:
    """Points by truth and by answer, at each of many thresholds.

    A point is called rain where its probability is greater than the threshold. At the first
    threshold, 0, all points are called rain, including those of probability 0.

    Attributes:
        thresholds: Rising from 0 to 1, float64 (T,).
        true_positive: Rain called rain, int64 (T,).
        false_positive: Other points called rain, int64 (T,).
        rain: Points that are rain.
        other: Points that are not.
    """

    thresholds: Floats
    true_positive: Ints
    false_positive: Ints
    rain: int
    other: int

    @property
    def precision(self) -> Floats:
        """Share of rain among what is called rain, float64 (T,); NaN where nothing is."""
        return ratio(self.true_positive, self.true_positive + self.false_positive)

    @property
    def recall(self) -> Floats:
        """Share of the rain that is called rain, float64 (T,); NaN where there is none."""
        return ratio(self.true_positive, self.rain)

    @property
    def iou(self) -> Floats:
        """IoU of rain, float64 (T,); NaN where no point is rain or called rain."""
        missed = self.rain - self.true_positive
        return intersection_over_union(self.true_positive, self.false_positive + missed)

    @property
    def average_precision(self) -> float:
        """Mean precision over the recall, in steps between thresholds; NaN without rain.

        Source: the sum over thresholds of (R_n - R_{n-1}) P_n, as scikit-learn's
        ``average_precision_score`` defines it.
        """
        if not self.rain:
            return math.nan
        gained = self.recall - np.append(self.recall[1:], 0)
        some = gained > 0  # otherwise the precision may be undefined
        return float(gained[some] @ self.precision[some])

    @property
    def best(self) -> int:
        """Number of the threshold with the greatest IoU; the middle one of several.

        There must be rain.
        """
        best = np.flatnonzero(self.iou == self.iou.max())
        return int(best[len(best) // 2])

    def at(self, threshold: float) -> int:
        """Number of the nearest threshold."""
        return int(np.abs(self.thresholds - threshold).argmin())

    def counts(self, number: int) -> Counts:
        """Counts at a threshold, given by its number."""
        hits, false = int(self.true_positive[number]), int(self.false_positive[number])
        return Counts(hits, false, self.rain - hits, self.other - false)


class ThresholdCounts(Metric):
    """Counts probabilities of rain between thresholds, in int64 and constant memory.

    Counts add up across processes. As :meth:`points` gathers them, each process must call it.

    Args:
        chosen: Further thresholds from 0 to 1, besides ``CURVE_THRESHOLDS`` and ``CLOSE``.
    """

    full_state_update = False
    bins: Tensor

    def __init__(self, chosen: Sequence[float] = ()) -> None:
        super().__init__()
        self.thresholds = np.unique([*CURVE_THRESHOLDS, *CLOSE, *(1 - CLOSE), *chosen])
        # Points by whether they are rain, and by how many thresholds their probability exceeds.
        bins = torch.zeros(2, len(self.thresholds) + 1, dtype=torch.int64)
        self.add_state("bins", bins, dist_reduce_fx="sum")

    def update(self, probability: Float32s, rain: Bools) -> None:
        """Counts the points of a scan.

        Args:
            probability: Probability of rain of every point, float32 (N,), 0 to 1.
            rain: Points that are rain, bool (N,).
        """
        # A threshold is compared with probabilities in their own precision.
        exceeded = np.searchsorted(self.thresholds.astype(probability.dtype), probability)
        counted = table_of((rain.astype(np.int64), exceeded), tuple(self.bins.shape))
        self.bins += torch.from_numpy(counted).to(self.device)

    def compute(self) -> dict[str, Tensor]:
        """The average precision, a float32 scalar by that name."""
        score = self._points().average_precision
        return {"average_precision": torch.tensor(score, dtype=torch.float32, device=self.device)}

    def points(self) -> OperatingPoints:
        """The counts at each threshold."""
        with self.sync_context():
            return self._points()

    def _points(self) -> OperatingPoints:
        bins = self.bins.cpu().numpy()
        exceeding = bins[:, ::-1].cumsum(axis=1)[:, ::-1]
        other, rain = exceeding[:, 0].tolist()
        called = exceeding[:, 1:].copy()
        called[:, 0] = other, rain
        return OperatingPoints(self.thresholds, called[1], called[0], rain, other)
