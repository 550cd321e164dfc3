"""A teacher's answers and its student's, by range, and measured by labels that lie beside them."""

from collections.abc import Sequence
from dataclasses import astuple, dataclass, field

import numpy as np

from derain.cards.card import DataCard
from derain.evaluation.counts import (
    RANGE_EDGES,
    Counts,
    RainCounts,
    band_names,
    band_of,
    ratio,
    table_of,
)
from derain.evaluation.text_tables import number_text, plain_table
from derain.scan import Bools, Floats, Ints, Scan
from derain.sources.frame import Frame
from derain.sources.reader import FrameReader
from derain.views.morton import first_rows

# A teacher's answer for a point, as the number of its column in a table of answers.
NOT_RAIN, RAIN, NOT_KNOWN = range(3)
TEACHERS_ANSWERS = {NOT_RAIN: "not rain", RAIN: "rain", NOT_KNOWN: "not known"}

_SHAPE = (len(RANGE_EDGES), len(TEACHERS_ANSWERS), 2)

# What a teacher's answers are measured on.
OF_TEACHER = ("all points", "points it is sure of")


def answer_of(scan: Scan, card: DataCard) -> Ints:
    """The teacher's answer for each point, as a number of ``TEACHERS_ANSWERS``, int64 (N,).

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
    """Points by range, by the teacher's answer and by the student's.

    Attributes:
        table: Points, int64 (bands of ``RANGE_EDGES``, answers of the teacher, 2); of the last
            axis the second counts what the student calls rain. Without a student, all are in the
            first. By default there are none.
    """

    table: Ints = field(default_factory=lambda: np.zeros(_SHAPE, np.int64))

    @classmethod
    def of(cls, scan: Scan, card: DataCard, called_rain: Bools | None = None) -> "Answers":
        """Counts the valid points of one scan.

        Args:
            scan: A scan with the teacher's labels.
            card: Data card of these labels.
            called_rain: The student's rain, bool (N,); None without a student.

        Raises:
            InputError: A scan without labels.
        """
        answer = answer_of(scan, card)
        student = np.zeros(len(scan), np.int64) if called_rain is None else called_rain
        valid = scan.valid
        band = band_of(scan.range[valid])
        return cls(table_of((band, answer[valid], student[valid].astype(np.int64)), _SHAPE))

    def __add__(self, other: "Answers") -> "Answers":
        """Counts of the points of both."""
        return Answers(self.table + other.table)

    @property
    def points(self) -> int:
        """Number of points."""
        return int(self.table.sum())

    @property
    def rain(self) -> int:
        """Points that the teacher calls rain."""
        return int(self.table[:, RAIN].sum())

    @property
    def shares(self) -> Floats:
        """Share of each answer of the teacher, float64 (3,); NaN where there are no points."""
        return ratio(self.table.sum(axis=(0, 2)), self.points)

    @property
    def rain_among_known(self) -> float:
        """Share of rain among the points that the teacher is sure of; NaN if there are none."""
        not_rain, rain, _ = self.table.sum(axis=(0, 2))
        return float(ratio(rain, not_rain + rain))

    @property
    def removed(self) -> float:
        """Share of the points that the student calls rain; NaN where there are none."""
        return float(ratio(self.table[..., 1].sum(), self.points))

    @property
    def agreement(self) -> Counts:
        """Counts of the student's answers, with the teacher's sure answers as the truth."""
        kept, called = self.table.sum(axis=0).T
        return Counts(
            true_positive=int(called[RAIN]),
            false_positive=int(called[NOT_RAIN]),
            false_negative=int(kept[RAIN]),
            true_negative=int(kept[NOT_RAIN]),
        )

    @property
    def by_range(self) -> dict[str, "Answers"]:
        """The answers in each band of ``RANGE_EDGES``, by its name."""
        return {name: Answers(self.table[[band]]) for band, name in enumerate(band_names())}

    def __str__(self) -> str:
        """Points and the shares of the teacher's answers, by range, as a table."""
        rows = [["range", "points", *TEACHERS_ANSWERS.values()]]
        for name, band in {**self.by_range, "all": self}.items():
            shares = (number_text(share, ".1%") for share in band.shares)
            rows.append([name, f"{band.points:,}", *shares])
        return plain_table(rows)


class TruthRecord:
    """Measures answers by the labels that came with the scans; as text, two tables.

    Args:
        card: Data card of the scans.

    Attributes:
        scans: Number of scans that were measured.
        counts: The points of all scans, by what they are measured on (``OF_TEACHER``).
    """

    def __init__(self, card: DataCard) -> None:
        self.card = card
        self.scans = 0
        self.counts = {title: RainCounts(card) for title in OF_TEACHER}

    def add(self, frame: Frame, scan: Scan, *answers: tuple[Bools, Bools]) -> None:
        """Measures the answers to one scan.

        Args:
            frame: The scan's frame, with its own labels.
            scan: All N points of it.
            answers: For each title, which points are called rain and which are counted, bool (N,).

        Raises:
            InputError: Labels that cannot be read, or that the data card does not name.
        """
        truth = FrameReader(self.card).with_labels(scan, frame)
        rows = first_rows(truth) if self.card.deduplicate else truth.valid.nonzero()[0]
        for counts, (rain, counted) in zip(self.counts.values(), answers, strict=True):
            of_answer = rows[counted[rows]]
            counts.add(truth.take(of_answer), rain[of_answer])
        self.scans += 1

    def add_cells(self, cells: Sequence[Ints]) -> None:
        """Adds a scan that another record has measured.

        Args:
            cells: For each title, the :attr:`RainCounts.cells` of the other record.
        """
        for counts, of_title in zip(self.counts.values(), cells, strict=True):
            counts.add_cells(of_title)
        self.scans += 1

    def __str__(self) -> str:
        scores = [["", "points", "precision", "recall", "IoU"]]
        for title, counted in self.counts.items():
            pooled = counted.pooled
            numbers = map(number_text, (pooled.precision, pooled.recall, pooled.iou))
            scores.append([title, f"{sum(astuple(pooled)):,}", *numbers])
        classes = [["class", "points", "called rain", "of those it is sure of"]]
        of_all, of_sure = (counts.by_class for counts in self.counts.values())
        for name, counts in of_all.items():
            if counts.points:
                title = f"{name} (rain)" if counts.rain else name
                shares = (counts.share_lost, of_sure[name].share_lost)
                called = (number_text(share, ".2%") for share in shares)
                classes.append([title, f"{counts.points:,}", *called])
        return f"{plain_table(scores)}\n{plain_table(classes)}"
