"""Proves an exported model against the network it was exported from."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from derain.evaluation.counts import ratio
from derain.export.runtime import Derainer
from derain.scan import Scan
from derain.views.probability import probability_of_rain
from derain.views.view import SeenScan

THREADS = (1, 2)


@dataclass(frozen=True)
class Bounds:
    """What an exported model may differ by from PyTorch on a scan.

    Attributes:
        difference: Largest difference of a logit, as a share of the scan's largest logit where
            that is above 1; None where any may be.
        flipped: Share of the cells that may lie on the other side of the threshold; None where any
            may. One cell always may, since in a small scan it is more than any such share.
        rain_iou: What the two must have in common: the cells with a return that both call rain, as
            a share of those that either does, over all scans of these bounds; None where it may be
            anything.
    """

    difference: float | None
    flipped: float | None
    rain_iou: float | None = None


# float32 keeps seven digits, and a sum of a thousand products may lose three of them.
FLOAT32 = Bounds(difference=1e-4, flipped=1e-4)

# Eight bits keep two digits of every activation: what counts is what becomes of the rain. Networks
# that have hardly been trained, most of whose rain is near the threshold, have kept .82 of it.
INT8 = Bounds(difference=None, flipped=None, rain_iou=0.7)

# On scans unlike those that the eight bits were scaled for, the two may differ as they like, as
# long as the scores are finite.
FINITE = Bounds(difference=None, flipped=None)


@dataclass(frozen=True)
class Case:
    """How one scan came out.

    Attributes:
        name: What is hard about the scan.
        points: Cells that the network judged: points, or pixels.
        threads: Threads of onnxruntime.
        difference: Largest difference of a logit from PyTorch's, as a share of the scan's largest
            logit where that is above 1.
        flipped: Cells on the other side of the threshold.
        finite: Whether every logit is finite.
        both: Cells with a return that both call rain.
        either: Cells with a return that one or both call rain.
        bounds: What it may differ by.
    """

    name: str
    points: int
    threads: int
    difference: float
    flipped: int
    finite: bool
    both: int = 0
    either: int = 0
    bounds: Bounds = FLOAT32

    @property
    def holds(self) -> bool:
        """Whether the exported model may be trusted on this scan."""
        near = self.bounds.difference is None or self.difference <= self.bounds.difference
        share = self.bounds.flipped
        alike = share is None or self.flipped <= max(1, share * self.points)
        return self.finite and near and alike


@dataclass(frozen=True)
class Proof:
    """How an exported model compares with PyTorch on every scan tried."""

    cases: tuple[Case, ...]

    @property
    def holds(self) -> bool:
        """Whether every case does, and both find enough of the same rain."""
        return all(case.holds for case in self.cases) and self.rain_iou >= self.least_rain_iou

    @property
    def least_rain_iou(self) -> float:
        """What the IoU of the rain must be; 0 where no case bounds it."""
        return max((case.bounds.rain_iou or 0.0 for case in self.cases), default=0.0)

    @property
    def rain_iou(self) -> float:
        """IoU of what the two call rain, over the scans that it is bounded on, or over all.

        Where there is no rain it is 0: nothing has been shown to be found.
        """
        bounded = [case for case in self.cases if case.bounds.rain_iou is not None] or self.cases
        either = sum(case.either for case in bounded)
        return float(ratio(sum(case.both for case in bounded), either, undefined=0.0))

    def as_dict(self) -> dict[str, Any]:
        """The proof as JSON-able primitives."""
        return {
            "largest_difference": max(case.difference for case in self.cases),
            "flipped": sum(case.flipped for case in self.cases),
            "points": sum(case.points for case in self.cases),
            "rain_iou": self.rain_iou,
            "cases": [asdict(case) for case in self.cases],
        }

    def __str__(self) -> str:
        worst = max(self.cases, key=lambda case: case.difference)
        lines = [
            f"{'' if case.holds else 'FAILED '}{case.name}: {case.points:,} points, "
            f"{case.threads} threads, largest difference {case.difference:.1e}, "
            f"{case.flipped} flipped"
            for case in self.cases
            if not case.holds or case is worst
        ]
        points = sum(case.points for case in self.cases)
        flipped = sum(case.flipped for case in self.cases)
        lines.append(
            f"{len(self.cases)} cases, {points:,} points or pixels: largest logit difference "
            f"{worst.difference:.1e}, {flipped} labels flipped, IoU of the rain {self.rain_iou:.4f}"
        )
        if self.rain_iou < self.least_rain_iou:
            lines.append(f"FAILED: the IoU of the rain must be {self.least_rain_iou:g}")
        return "\n".join(lines)


def prove(
    forward: Callable[..., Tensor],
    model: Path,
    scans: Iterable[tuple[str, Scan]],
    bounds: Bounds = FLOAT32,
) -> Proof:
    """Runs an exported model and its network on the same scans.

    Args:
        forward: The network in evaluation mode, from raw inputs to logits.
        model: The exported file.
        scans: Names and scans.
        bounds: What the two may differ by.
    """
    derainers = [Derainer(model, threads) for threads in THREADS]
    # Mapped, for a loop would hold on to one scan while the next is read.
    cases = map(partial(_compared, forward, derainers, bounds), scans)
    return Proof(tuple(chain.from_iterable(cases)))


def _compared(
    forward: Callable[..., Tensor],
    derainers: Sequence[Derainer],
    bounds: Bounds,
    named: tuple[str, Scan],
) -> list[Case]:
    """One scan, by PyTorch and by the same model on different numbers of threads."""
    name, scan = named
    view = derainers[0].view(scan)
    tensors = {title: torch.from_numpy(array) for title, array in view.inputs().items()}
    with torch.inference_mode():
        expected = forward(**tensors).numpy()
    # Cells with a return are those that would be rain if every point of the scan were.
    returned = view.target(np.ones(len(scan), bool)) == 1
    return [_case(name, view, returned, expected, derainer, bounds) for derainer in derainers]


def _case(
    name: str,
    view: SeenScan,
    returned: NDArray[np.bool_],
    expected: NDArray[np.float32],
    derainer: Derainer,
    bounds: Bounds,
) -> Case:
    logits = derainer.logits(view)
    magnitude = max(1.0, float(np.abs(expected).max(initial=0)))
    # What is not a number differs as much as can be, and must not be lost in a maximum.
    difference = np.nan_to_num(np.abs(logits - expected) / magnitude, nan=np.inf, posinf=np.inf)
    threshold = derainer.spec.threshold
    rain, expected_rain = (probability_of_rain(one) > threshold for one in (logits, expected))
    return Case(
        name=name,
        points=len(expected),
        threads=derainer.threads,
        difference=float(difference.max(initial=0)),
        flipped=int((rain != expected_rain).sum()),
        finite=bool(np.isfinite(logits).all()),
        both=int((rain & expected_rain & returned).sum()),
        either=int(((rain | expected_rain) & returned).sum()),
        bounds=bounds,
    )
