"""Which scan a process reads, and when."""

from collections.abc import Iterator, Sequence, Sized
from typing import TYPE_CHECKING, NamedTuple, cast

import numpy as np
from torch.utils.data import DistributedSampler

from derain.learning.seeds import Draw, generator_of

if TYPE_CHECKING:
    from derain.datamodules.scan_dataset import ScanDataset


class Pick(NamedTuple):
    """One scan to be read.

    Attributes:
        number: Its number among the scans of its part.
        epoch: The epoch that it is read in.
        measured: Whether what a network says of it is counted or written.
        again: How often it was drawn before in that epoch.
    """

    number: int
    epoch: int = 0
    measured: bool = True
    again: int = 0


class TrainingOrder(DistributedSampler[Pick]):
    """Every scan once an epoch, in an order that is a function of the run's seed and the epoch.

    Processes take the scans in turn: at each step they see together what one process would see in a
    batch as many times as large. So that all take as many steps, the first of the order may come
    twice.

    Lightning tells the epoch to every sampler, and leaves those of this kind alone on several
    processes.

    Args:
        scans: The scans.
        seed: Seed of the run.
        processes: How many processes share the scans.
        process: Which of them this is.
    """

    def __init__(self, scans: Sized, seed: int, processes: int, process: int) -> None:
        # Of what it is given, the sampler asks no more than how many there are.
        super().__init__(cast("ScanDataset", scans), processes, process, seed=seed)
        self.scans = len(scans)

    def picks(self) -> Sequence[Pick]:
        """What all processes together read in this epoch, before it is put in order."""
        return [Pick(number, self.epoch, measured=False) for number in range(self.scans)]

    def __iter__(self) -> Iterator[Pick]:
        picks = self.picks()
        generator = generator_of(Draw.ORDER, self.seed, self.epoch)
        order = np.resize(generator.permutation(len(picks)), self.total_size)
        for place in order[self.rank :: self.num_replicas]:
            yield picks[place]


class MeasuringOrder(DistributedSampler[Pick]):
    """Every scan once, in order, whole batches going to the processes in turn.

    So a batch is the same however many processes there are. Where one has a batch less, it reads a
    scan again that is not measured: processes wait for each other at every step.

    Args:
        scans: The scans.
        batch_size: Scans in a batch.
        processes: How many processes share the scans.
        process: Which of them this is.
    """

    def __init__(self, scans: "ScanDataset", batch_size: int, processes: int, process: int) -> None:
        super().__init__(scans, processes, process, shuffle=False)
        numbers = range(len(scans))
        batches = [
            numbers[start : start + batch_size] for start in range(0, len(numbers), batch_size)
        ]
        own = batches[process::processes]
        self.picks = [Pick(number) for batch in own for number in batch]
        if len(own) < len(batches[::processes]):
            self.picks.append(Pick(0, measured=False))

    def __len__(self) -> int:
        return len(self.picks)

    def __iter__(self) -> Iterator[Pick]:
        return iter(self.picks)
