"""Several scans on their way through a network."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import torch
from torch import Tensor

from derain.cards.card import DataCard
from derain.scan import Scan
from derain.views.view import IGNORED, BackProjection, ViewedScan

# What is timed of the making of a batch: reading files, and viewing what was read, its augmentation
# and packing included.
READ, VIEW = "read", "view"


@dataclass(frozen=True, eq=False)
class Sample:
    """One scan and what a network sees of it.

    Attributes:
        scan: The whole scan, with its labels where they are known.
        view: The network's view of it.
        target: The class of each of its cells, int64 (M,); None without labels.
        measured: True if the network's answers are counted or written: not in training, nor of a
            scan that is only read again so that all processes take as many steps.
        key: Name of results of the scan: the key of its frame.
        milliseconds: Time to make it, by ``READ`` and ``VIEW``, wall time.
    """

    scan: Scan
    view: ViewedScan
    target: Tensor | None
    measured: bool = True
    key: str = ""
    milliseconds: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of(cls, scan: Scan, view: ViewedScan, card: DataCard, key: str = "") -> "Sample":
        """Gives a view its target, by the labels of its scan if there are any.

        Cells of points of unknown class are not judged.
        """
        if scan.label is None:
            return cls(scan, view, None, key=key)
        target = view.target(card.rain_of(scan))
        target[view.target(card.unknown_of(scan)) == 1] = IGNORED
        return cls(scan, view, torch.from_numpy(target), key=key)


@dataclass(frozen=True, eq=False)
class MeasuredScan:
    """The data of a scan that are needed after the network has scored it.

    Attributes:
        scan: The whole scan, with its labels where they are known.
        back_projection: Carries scores of its cells to its rows.
        key: Name of results of the scan.
    """

    scan: Scan
    back_projection: BackProjection
    key: str


@dataclass(frozen=True, eq=False)
class Batch:
    """Several scans, packed.

    Attributes:
        inputs: The network's inputs by name, scans one after the other.
        target: The class of each cell, int64 (M,); None without labels.
        cells: Number of cells of each scan, in order.
        measured: The scans, in order, where the network's answers are counted or written;
            else none, so that no worker sends what nobody needs.
        milliseconds: Time to make its scans, one after the other, by ``READ`` and
            ``VIEW``, wall time of the process that made them.
    """

    inputs: dict[str, Tensor]
    target: Tensor | None
    cells: Sequence[int]
    measured: Sequence[MeasuredScan]
    milliseconds: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of(cls, samples: Sequence[Sample]) -> "Batch":
        """Packs samples of one kind of view, which sees to it that scans do not mix.

        All of them are measured, or none.
        """
        packed = type(samples[0].view).pack([sample.view for sample in samples])
        targets = [sample.target for sample in samples if sample.target is not None]
        return cls(
            inputs={name: torch.from_numpy(array) for name, array in packed.items()},
            target=torch.cat(targets) if len(targets) == len(samples) else None,
            cells=[sample.view.size for sample in samples],
            measured=[
                MeasuredScan(sample.scan, sample.view.back_projection(), sample.key)
                for sample in samples
                if sample.measured
            ],
            milliseconds=summed_times([sample.milliseconds for sample in samples]),
        )

    def to(self, device: torch.device, non_blocking: bool = False) -> "Batch":
        """The same batch with its tensors on a device; the scans stay in main memory."""
        inputs = {
            name: tensor.to(device, non_blocking=non_blocking)
            for name, tensor in self.inputs.items()
        }
        target = self.target
        if target is not None:
            target = target.to(device, non_blocking=non_blocking)
        return replace(self, inputs=inputs, target=target)

    def split(self, values: Tensor) -> list[Tensor]:
        """Takes values of all cells, (M, ...), such as scores, apart into those of each scan."""
        return list(torch.split(values, list(self.cells)))


def summed_times(parts: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """Adds up how long several things took, by the names of what is timed of them."""
    return {
        name: sum(part.get(name, 0.0) for part in parts)
        for name in dict.fromkeys(name for part in parts for name in part)
    }
