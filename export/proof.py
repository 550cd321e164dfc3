"""Proves an exported model against the network it was exported from."""

from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from derain.evaluation.counts import or_none, ratio
from derain.evaluation.text_tables import number_text
from derain.export.runtime import Derainer
from derain.export.runtimes.session import DEFAULT_RUNTIME, Runtime
from derain.scan import Bools, Float32s, Scan
from derain.views.probability import probability_of_rain
from derain.views.view import ViewedScan

THREADS = (1, 2)


@dataclass(frozen=True)
class Bounds:
    """The permitted differences of an exported model from PyTorch on a scan.

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

# bfloat16 keeps eight bits of every number, two digits and a half. Networks of up to ninety layers
# have added that up to .056 of the largest logit, and to .007 of the cells of one scan.
BF16 = Bounds(difference=0.1, flipped=0.02)

# On scans unlike those that the eight bits were scaled for, the two may differ as they like, as
# long as the scores are finite.
FINITE = Bounds(difference=None, flipped=None)


@dataclass(frozen=True)
class Case:
    """The comparison on one scan.

    Attributes:
        name: The difficulty of the scan.
        points: Cells that the network judged: points, or pixels.
        threads: Threads of the runtime.
        difference: Largest difference of a logit from PyTorch's, as a share of the scan's largest
            logit where that is above 1.
        flipped: Cells on the other side of the threshold.
        finite: True if every logit is finite.
        both: Cells with a return that both call rain.
        either: Cells with a return that one or both call rain.
        bounds: Permitted differences.
        runtime: Runtime of the exported model, with its precision where that is not float32.
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
    runtime: str = DEFAULT_RUNTIME

    @property
    def holds(self) -> bool:
        """True if the exported model may be trusted on this scan."""
        near = self.bounds.difference is None or self.difference <= self.bounds.difference
        share = self.bounds.flipped
        alike = share is None or self.flipped <= max(1, share * self.points)
        return self.finite and near and alike

    def __str__(self) -> str:
        failed = "" if self.holds else "FAILED "
        by = "" if self.runtime == DEFAULT_RUNTIME else f"{self.runtime}: "
        return (
            f"{by}{failed}{self.name}: {self.points:,} points, {self.threads} threads, "
            f"largest difference {self.difference:.1e}, {self.flipped} flipped"
        )


@dataclass(frozen=True)
class Proof:
    """The comparison of an exported model with PyTorch on all scans.

    Attributes:
        cases: The scans, on each number of threads, by each runtime.
    """

    cases: tuple[Case, ...]

    @property
    def holds(self) -> bool:
        """True if every case does, and both find enough of the same rain."""
        return self.finds_enough and all(case.holds for case in self.cases)

    @property
    def least_rain_iou(self) -> float | None:
        """The required IoU of the rain; None if no case bounds it."""
        return max(filter(None, (case.bounds.rain_iou for case in self.cases)), default=None)

    @property
    def finds_enough(self) -> bool:
        """True if the IoU of the rain is as great as it must be; if it is undefined, it is not."""
        return self.least_rain_iou is None or self.rain_iou >= self.least_rain_iou

    @property
    def rain_iou(self) -> float:
        """IoU of what the two call rain, over the scans that it is bounded on, or over all.

        It is NaN where neither calls anything rain.
        """
        bounded = [case for case in self.cases if case.bounds.rain_iou is not None] or self.cases
        either = sum(case.either for case in bounded)
        return float(ratio(sum(case.both for case in bounded), either))

    @property
    def worst(self) -> Case:
        """The case with the largest difference."""
        return max(self.cases, key=lambda case: case.difference)

    @property
    def points(self) -> int:
        """Cells of all cases."""
        return sum(case.points for case in self.cases)

    @property
    def flipped(self) -> int:
        """Cells of all cases that are on the other side of the threshold."""
        return sum(case.flipped for case in self.cases)

    def as_dict(self) -> dict[str, Any]:
        """The proof as JSON-able primitives."""
        return {
            "largest_difference": self.worst.difference,
            "flipped": self.flipped,
            "points": self.points,
            "rain_iou": or_none(self.rain_iou),
            "cases": [asdict(case) for case in self.cases],
        }

    def __str__(self) -> str:
        """The worst case and those that fail, and a summary."""
        lines = [str(case) for case in self.cases if not case.holds or case is self.worst]
        lines.append(
            f"{len(self.cases)} cases, {self.points:,} points or pixels: largest logit "
            f"difference {self.worst.difference:.1e}, {self.flipped} labels flipped, "
            f"IoU of the rain {number_text(self.rain_iou, '.4f')}"
        )
        if not self.finds_enough:
            lines.append(f"FAILED: the IoU of the rain must be {self.least_rain_iou:g}")
        return "\n".join(lines)


def prove(
    forward: Callable[..., Tensor],
    model: Path,
    scans: Iterable[tuple[str, Scan]],
    bounds: Bounds = FLOAT32,
    runtime: Runtime = Runtime(),
) -> Proof:
    """Runs an exported model and its network on the same scans.

    Args:
        forward: The network in evaluation mode, from raw inputs to logits.
        model: The exported file.
        scans: Names and scans.
        bounds: Permitted differences.
        runtime: Runtime of the exported model.
    """
    derainers = [Derainer(model, count, runtime.name, runtime.precision) for count in THREADS]

    def compared(named: tuple[str, Scan]) -> list[Case]:
        name, scan = named
        view = derainers[0].view(scan)
        tensors = {title: torch.from_numpy(array) for title, array in view.inputs().items()}
        with torch.inference_mode():
            expected = forward(**tensors).numpy()
        # Cells with a return are those that would be rain if every point of the scan were.
        returned = view.target(np.ones(len(scan), bool)) == 1
        return [_case(name, view, returned, expected, derainer, bounds) for derainer in derainers]

    # Mapped, for a loop would hold on to one scan while the next is read.
    return Proof(tuple(chain.from_iterable(map(compared, scans))))


def _case(
    name: str,
    view: ViewedScan,
    returned: Bools,
    expected: Float32s,
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
        runtime=str(derainer.runtime),
    )
