"""How many scans of each of several data sets an epoch of training has, and which."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from derain.datamodules.order import Pick, TrainingOrder
from derain.errors import InputError
from derain.learning.seeds import Draw, generator_of


@dataclass(frozen=True)
class Draws:
    """What an epoch of training draws from several data sets, whose scans are counted through.

    Each is gone through again and again, in another order every time, and an epoch goes on where
    the last one ended: of one data set no scan is seen twice more often than another. Where an
    epoch ended is a function of its number, so that nothing has to be remembered for it.

    Attributes:
        scans: Number of scans of each data set, in order.
        drawn: How many of them an epoch draws, in the same order.
    """

    scans: tuple[int, ...]
    drawn: tuple[int, ...]

    @classmethod
    def by_weight(
        cls, scans: Mapping[str, int], weights: Mapping[str, float], total: int | None = None
    ) -> "Draws":
        """Shares out an epoch by weight, exactly but for what rounding to whole scans needs.

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
            if not number:
                raise InputError(
                    f"part '{name}'",
                    f"its weight gives it none of the {total} scans of an epoch",
                    "Give it more weight, or an epoch more scans: --data.scans_per_epoch.",
                )
        return cls(tuple(scans.values()), drawn)

    def picks(self, seed: int, epoch: int) -> list[Pick]:
        """What is drawn for an epoch, one data set after the other."""
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

    def _of_one(self, place: int, seed: int, epoch: int) -> NDArray[np.int64]:
        """Numbers of the scans of one data set that an epoch draws."""
        scans, drawn = self.scans[place], self.drawn[place]
        first, skipped = divmod(epoch * drawn, scans)
        passes = range(first, first + -(-(skipped + drawn) // scans))
        orders = [generator_of(Draw.MIXTURE, seed, one, place).permutation(scans) for one in passes]
        return np.concatenate(orders)[skipped : skipped + drawn]


class DrawnOrder(TrainingOrder):
    """What is drawn for an epoch, in an order that is a function of the run's seed and the epoch.

    Args:
        draws: What is drawn.
        seed: Seed of the run.
        processes: How many processes share the scans.
        process: Which of them this is.
    """

    def __init__(self, draws: Draws, seed: int, processes: int, process: int) -> None:
        super().__init__(range(sum(draws.drawn)), seed, processes, process)
        self.draws = draws

    def picks(self) -> Sequence[Pick]:
        """What all processes together read in this epoch, before it is put in order."""
        return self.draws.picks(self.seed, self.epoch)


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
