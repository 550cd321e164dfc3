"""Answers of a teacher and its student, measured by the labels that came with the scans."""

from collections.abc import Sequence
from dataclasses import astuple

import numpy as np
from numpy.typing import NDArray

from derain.cards.card import DataCard
from derain.evaluation.rain_counts import RainCounts
from derain.evaluation.text_tables import number_text, plain_table
from derain.scan import Scan
from derain.sources.frame import Frame
from derain.sources.reader import FrameReader
from derain.views.morton import first_rows

# Which points of a scan of N points, bool (N,).
Mask = NDArray[np.bool_]

# What a teacher's answers are measured on.
OF_TEACHER = ("all points", "points it is sure of")


class TruthRecord:
    """Measures answers by the labels that came with the scans; as text, two tables.

    Args:
        card: Data card of the scans.
        titles: What each answer is called.

    Attributes:
        scans: Number of scans that were measured.
        counts: The points of all scans, by the title of the answer.
    """

    def __init__(self, card: DataCard, titles: Sequence[str] = OF_TEACHER) -> None:
        self.card = card
        self.scans = 0
        self.counts = {
            title: RainCounts(card.classes, card.rain, unknown=card.unknown) for title in titles
        }

    def add(self, frame: Frame, scan: Scan, *answers: tuple[Mask, Mask]) -> None:
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

    def add_cells(self, cells: Sequence[NDArray[np.int64]]) -> None:
        """Adds a scan that another record has measured.

        Args:
            cells: For each title, the :attr:`RainCounts.cells` of the other record.
        """
        for counts, of_title in zip(self.counts.values(), cells, strict=True):
            counts.add_cells(of_title)
        self.scans += 1

    def rows_by_class(self, first: str, second: str) -> list[list[str]]:
        """Each class that has points: its name, its points, and what two answers call rain."""
        others, rows = self.counts[second].by_class(), []
        for name, counts in self.counts[first].by_class().items():
            if counts.points:
                title = f"{name} (rain)" if counts.rain else name
                shares = (counts.share_lost, others[name].share_lost)
                called = (number_text(share, ".2%") for share in shares)
                rows.append([title, f"{counts.points:,}", *called])
        return rows

    def __str__(self) -> str:
        scores = [["", "points", "precision", "recall", "IoU"]]
        for title, counted in self.counts.items():
            pooled = counted.pooled()
            numbers = map(number_text, (pooled.precision, pooled.recall, pooled.iou))
            scores.append([title, f"{sum(astuple(pooled)):,}", *numbers])
        classes = [["class", "points", "called rain", "of those it is sure of"]]
        classes += self.rows_by_class(*self.counts)
        return f"{plain_table(scores)}\n{plain_table(classes)}"
