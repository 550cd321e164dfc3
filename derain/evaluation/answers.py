"""What a teacher says of points, and what its student makes of them, counted by range."""

from dataclasses import dataclass
from functools import reduce
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from derain.cards.card import DataCard
from derain.evaluation.counts import Counts, ratio
from derain.scan import Scan

# What a teacher says of a point, as a number of its column in a table of answers.
NOT_RAIN, RAIN, NOT_KNOWN = range(3)
TEACHERS_ANSWERS = {NOT_RAIN: "not rain", RAIN: "rain", NOT_KNOWN: "not known"}

# Where the bands of range start that answers are counted in, metres; the last one is open.
FINE_EDGES = tuple(range(0, 85, 5))
COARSE_EDGES = (0, 10, 20, 40, 80)


def answer_of(scan: Scan, card: DataCard) -> NDArray[np.int64]:
    """What a teacher says of each point, as a number of ``TEACHERS_ANSWERS``, int64 (N,).

    Args:
        scan: A scan with the teacher's labels.
        card: Data card of these labels.

    Raises:
        InputError: A scan without labels.
    """
    choices = [card.unknown_of(scan), card.rain_of(scan)]
    return np.select(choices, [NOT_KNOWN, RAIN], default=NOT_RAIN)


@dataclass(frozen=True, eq=False)
class Answers:
    """Points by their range, by what the teacher says of them, and by what the student does.

    Attributes:
        table: Points, int64 (bands of ``FINE_EDGES``, answers of the teacher, 2); of the last axis
            the second is what the student calls rain. Where no student was asked, all are in the
            first.
    """

    table: NDArray[np.int64]

    @classmethod
    def of(
        cls, scan: Scan, card: DataCard, called_rain: NDArray[np.bool_] | None = None
    ) -> "Answers":
        """Counts the points of one scan that can be judged.

        Args:
            scan: A scan with the teacher's labels.
            card: Data card of these labels.
            called_rain: What the student calls rain, bool (N,); None where it was not asked.

        Raises:
            InputError: A scan without labels.
        """
        answer = answer_of(scan, card)
        student = np.zeros(len(scan), np.int64) if called_rain is None else called_rain
        valid = scan.valid
        band = np.searchsorted(FINE_EDGES, scan.range[valid], side="right") - 1
        shape = (len(FINE_EDGES), len(TEACHERS_ANSWERS), 2)
        cell = np.ravel_multi_index((band, answer[valid], student[valid].astype(int)), shape)
        return cls(np.bincount(cell, minlength=int(np.prod(shape))).reshape(shape))

    @classmethod
    def none(cls) -> "Answers":
        """Of no points."""
        return cls(np.zeros((len(FINE_EDGES), len(TEACHERS_ANSWERS), 2), np.int64))

    def __add__(self, other: "Answers") -> "Answers":
        """Of the points of both."""
        return Answers(self.table + other.table)

    def between(self, nearest: float, farthest: float) -> "Answers":
        """Of the points in the bands that start from one range and before another, metres."""
        start = np.array(FINE_EDGES)
        inside = (start >= nearest) & (start < farthest)
        return Answers(np.where(inside[:, None, None], self.table, 0))

    @property
    def points(self) -> int:
        """How many there are."""
        return int(self.table.sum())

    @property
    def shares(self) -> NDArray[np.float64]:
        """Share of each answer of the teacher, float64 (3,); NaN where there are no points."""
        return ratio(self.table.sum(axis=(0, 2)), self.points)

    @property
    def rain_among_known(self) -> float:
        """Share of rain among the points of which the teacher is sure; NaN where there are none."""
        not_rain, rain, _ = self.table.sum(axis=(0, 2))
        return float(ratio(rain, not_rain + rain))

    @property
    def removed(self) -> float:
        """Share of the points that the student calls rain; NaN where there are none."""
        return float(ratio(self.table[..., 1].sum(), self.points))

    @property
    def agreement(self) -> Counts:
        """The student beside the teacher, where that is sure, as if it were the truth."""
        kept, called = self.table.sum(axis=0).T
        return Counts(
            true_positive=int(called[RAIN]),
            false_positive=int(called[NOT_RAIN]),
            false_negative=int(kept[RAIN]),
            true_negative=int(kept[NOT_RAIN]),
        )


@dataclass(frozen=True)
class AnswersOfScan:
    """The answers of one scan.

    Attributes:
        key: What the scan is called.
        held_out: Whether the student did not learn from it, but was chosen and asked by it.
        answers: The answers.
    """

    key: str
    held_out: bool
    answers: Answers


def total(answers: "list[Answers]") -> Answers:
    """Of the points of all."""
    return reduce(Answers.__add__, answers, Answers.none())


def coarse_bands(answers: Answers) -> dict[str, Answers]:
    """The answers of each wide band of range, by names such as ``0-10 m`` and ``80+ m``."""
    bands = {f"{a}-{b} m": answers.between(a, b) for a, b in pairwise(COARSE_EDGES)}
    return {**bands, f"{COARSE_EDGES[-1]}+ m": answers.between(COARSE_EDGES[-1], np.inf)}
