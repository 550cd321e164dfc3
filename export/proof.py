"""Proves an exported model against the network it was exported from."""

from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from derain.export.runtime import Derainer
from derain.probability import probability_of_rain
from derain.scan import Scan
from derain.spec import Spec

THREADS = (1, 2)


@dataclass(frozen=True)
class Bounds:
    """What an exported model may differ by from PyTorch on a scan.

    Attributes:
        difference: Largest difference of a logit, as a share of the scan's largest logit where
            that is above 1; None where any may be.
        flipped: Share of the cells that may change sides. One always may: it is no share of a
            small scan.
    """

    difference: float | None
    flipped: float


# float32 keeps seven digits, and a sum of a thousand products may lose three of them.
FLOAT32 = Bounds(difference=1e-4, flipped=1e-4)

# Eight bits keep two digits of every activation: what counts is how many labels change.
INT8 = Bounds(difference=None, flipped=0.05)

# On scans unlike any that the eight bits were scaled for, the answer has to be one.
FINITE = Bounds(difference=None, flipped=1.0)


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
        finite: Whether every probability is finite.
        bounds: What it may differ by.
    """

    name: str
    points: int
    threads: int
    difference: float
    flipped: int
    finite: bool
    bounds: Bounds = FLOAT32

    @property
    def holds(self) -> bool:
        """Whether the exported model may be trusted on this scan."""
        near = self.bounds.difference is None or self.difference <= self.bounds.difference
        return self.finite and near and self.flipped <= max(1, self.bounds.flipped * self.points)


@dataclass(frozen=True)
class Proof:
    """How an exported model compares with PyTorch on every scan tried."""

    cases: tuple[Case, ...]

    @property
    def holds(self) -> bool:
        """Whether every case does."""
        return all(case.holds for case in self.cases)

    def as_dict(self) -> dict[str, Any]:
        """The proof as JSON-able primitives."""
        return {
            "largest_difference": max(case.difference for case in self.cases),
            "flipped": sum(case.flipped for case in self.cases),
            "points": sum(case.points for case in self.cases),
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
            f"{worst.difference:.1e}, {flipped} labels flipped"
        )
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
    cases = []
    for name, scan in scans:
        view = derainers[0].view(scan)
        tensors = {title: torch.from_numpy(array) for title, array in view.inputs().items()}
        with torch.inference_mode():
            expected = forward(**tensors).numpy()
        cases += [_compare(expected, derainer, name, scan, bounds) for derainer in derainers]
    return Proof(tuple(cases))


def _compare(
    expected: NDArray[np.float32], derainer: Derainer, name: str, scan: Scan, bounds: Bounds
) -> Case:
    view = derainer.view(scan)
    logits = derainer.session.run(None, view.inputs())[0]
    magnitude = max(1.0, float(np.abs(expected).max(initial=0)))
    # What is not a number differs as much as can be, and must not be lost in a maximum.
    difference = np.nan_to_num(np.abs(logits - expected) / magnitude, nan=np.inf, posinf=np.inf)
    return Case(
        name=name,
        points=len(expected),
        threads=derainer.threads,
        difference=float(difference.max(initial=0)),
        flipped=int((_is_rain(logits, derainer.spec) != _is_rain(expected, derainer.spec)).sum()),
        finite=bool(np.isfinite(derainer.probability(scan)).all()),
        bounds=bounds,
    )


def _is_rain(logits: NDArray[np.float32], spec: Spec) -> NDArray[np.bool_]:
    return probability_of_rain(logits) > spec.threshold
