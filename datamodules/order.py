"""The scans that an epoch draws, and the order in which a process reads them."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence, Sized
from dataclasses import dataclass
from typing import Any, NamedTuple, cast

import numpy as np
from torch.utils.data import Dataset, DistributedSampler

from derain.errors import InputError
from derain.learning.seeds import Draw, generator_of
from derain.scan import Ints


class Pick(NamedTuple):
    """One scan to be read.

    Attributes:
        number: Its number among the scans of its part.
        epoch: The epoch that it is read in.
        measured: True if the network's answer is counted or written.
        again: Number of times that it was drawn before in that epoch.
    """

    number: int
    epoch: int = 0
    measured: bool = True
    again: int = 0


@dataclass(frozen=True)
class Draws:
    """The number of scans that an epoch draws from each of several data sets, and the choice.

    The scans of all data sets are numbered consecutively. Each data set is passed through again and
    again, in a new order every time, and an epoch continues where the last one ended, so that all
    scans of a data set are drawn equally often. Where an epoch starts follows from its number:
    nothing has to be stored.

    Attributes:
        scans: Number of scans of each data set, in order.
        drawn: Number of scans that an epoch draws of each, in the same order.
    """

    scans: tuple[int, ...]
    drawn: tuple[int, ...]

    @classmethod
    def by_weight(
        cls, scans: Mapping[str, int], weights: Mapping[str, float], total: int | None = None
    ) -> "Draws":
        """Divides an epoch among the data sets by weight, rounded to whole scans.

        Example:
            >>> Draws.by_weight({"snow": 4, "streets": 40}, {"snow": 1, "streets": 2}, 10).drawn
            (3, 7)

        Args:
            scans: Number of scans of each data set, by its name.
            weights: Weight of each, greater than 0.
            total: Scans of an epoch; by default as many as all data sets have together.

        Raises:
            InputError: An epoch in which a data set has not one scan.
        """
        total = sum(scans.values()) if total is None else total
        drawn = shared_out(total, [weights[name] for name in scans])
        for name, number in zip(scans, drawn, strict=True):
            if number < 1:
                raise InputError(
                    f"part '{name}'",
                    f"its weight gives it none of the {total} scans of an epoch",
                    "Give it more weight, or an epoch more scans: --data.scans_per_epoch.",
                )
        return cls(tuple(scans.values()), drawn)

    def picks(self, seed: int, epoch: int) -> list[Pick]:
        """The scans that are drawn for an epoch, one data set after the other."""
        numbers = [
            offset + number
            for place, offset in enumerate(np.cumsum((0, *self.scans[:-1])).tolist())
            for number in self._of_one(place, seed, epoch).tolist()
        ]
        before: Counter[int] = Counter()
        picks = []
        for number in numbers:
            picks.append(Pick(number, epoch, measured=False, again=before[number]))
            before[number] += 1
        return picks

    def _of_one(self, place: int, seed: int, epoch: int) -> Ints:
        """Numbers of the scans of one data set that an epoch draws."""
        scans, drawn = self.scans[place], self.drawn[place]
        first, skipped = divmod(epoch * drawn, scans)
        passes = range(first, first + -(-(skipped + drawn) // scans))
        orders = [generator_of(Draw.MIXTURE, seed, one, place).permutation(scans) for one in passes]
        return np.concatenate(orders)[skipped : skipped + drawn]


class TrainingOrder(DistributedSampler[Pick]):
    """Training scans in a random order, which is a function of the run's seed and the epoch.

    Processes take the scans in turn: at each step they see together what one process would see in a
    batch as many times as large. So that all take as many steps, the first of the order may come
    twice.

    Lightning sets the epoch of every sampler, and does not replace a ``DistributedSampler``.

    Args:
        scans: The scans.
        seed: Seed of the run.
        processes: Number of processes that share the scans.
        process: Number of this process.
        draws: The scans that an epoch draws; None draws each once.
    """

    def __init__(
        self,
        scans: Sized,
        seed: int,
        processes: int,
        process: int,
        draws: Draws | None = None,
    ) -> None:
        drawn = len(scans) if draws is None else sum(draws.drawn)
        # The base class only needs the number of scans.
        super().__init__(cast("Dataset[Any]", range(drawn)), processes, process, seed=seed)
        self.scans = len(scans)
        self.draws = draws

    def picks(self) -> Sequence[Pick]:
        """The scans that all processes together read in this epoch, not yet in random order."""
        if self.draws is not None:
            return self.draws.picks(self.seed, self.epoch)
        return [Pick(number, self.epoch, measured=False) for number in range(self.scans)]

    def __iter__(self) -> Iterator[Pick]:
        picks = self.picks()
        generator = generator_of(Draw.ORDER, self.seed, self.epoch)
        order = np.resize(generator.permutation(len(picks)), self.total_size)
        for place in order[self.rank :: self.num_replicas]:
            yield picks[place]


class MeasuringOrder(DistributedSampler[Pick]):
    """Every scan once, in order; the processes take whole batches in turn.

    So batches do not depend on the number of processes. A process with a batch less reads one scan
    again, unmeasured, because processes wait for each other at every step.

    Args:
        scans: The scans.
        batch_size: Scans in a batch.
        processes: Number of processes that share the scans.
        process: Number of this process.
    """

    def __init__(self, scans: Sized, batch_size: int, processes: int, process: int) -> None:
        super().__init__(cast("Dataset[Any]", scans), processes, process, shuffle=False)
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


def shared_out(total: int, weights: Sequence[float]) -> tuple[int, ...]:
    """Whole numbers in proportion to weights, by the method of the largest remainder.

    Args:
        total: Their sum.
        weights: Greater than 0.
    """
    exact = total * np.array(weights) / sum(weights)
    whole = np.floor(exact).astype(int)
    # Sorted in a way that leaves equals in their order, so that everybody shares out alike.
    largest = np.argsort(whole - exact, kind="stable")[: total - int(whole.sum())]
    whole[largest] += 1
    return tuple(whole.tolist())
