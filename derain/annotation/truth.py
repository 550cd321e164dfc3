"""Scores of a teacher by the scans' own labels, for the record: they change nothing it teaches."""

from dataclasses import astuple

from derain.cards.card import DataCard
from derain.evaluation.counts import Counts
from derain.evaluation.rain_counts import RainCounts
from derain.evaluation.text_tables import number_text, plain_table
from derain.sources.frame import Frame
from derain.sources.judgement import Judgement
from derain.sources.reader import FrameReader
from derain.views.morton import first_rows


class TruthRecord:
    """Measures a teacher's answers by the scans' own labels, where there are any.

    Args:
        card: Data card of the scans.

    Attributes:
        scans: Number of scans with labels.
    """

    def __init__(self, card: DataCard) -> None:
        self.card = card
        self.scans = 0
        self._all, self._sure = (
            RainCounts(card.classes, card.rain, unknown=card.unknown) for _ in range(2)
        )

    def add(self, frame: Frame, judgement: Judgement) -> None:
        """Measures one scan; one without labels is skipped.

        Args:
            frame: The scan's frame, with its own labels.
            judgement: What the teacher returned for it.

        Raises:
            InputError: Labels that cannot be read, or that the data card does not name.
        """
        if not frame.has_labels:
            return
        scan = FrameReader(self.card).with_labels(judgement.scan, frame)
        rows = first_rows(scan) if self.card.deduplicate else scan.valid.nonzero()[0]
        self._all.add(scan.take(rows), judgement.rain[rows])
        sure = rows[judgement.answered[rows]]
        self._sure.add(scan.take(sure), judgement.rain[sure])
        self.scans += 1

    def __str__(self) -> str:
        scores = [["", "points", "precision", "recall", "IoU"]]
        for name, measured in (("all points", self._all), ("points it is sure of", self._sure)):
            scores.append([name, *_scores(measured.pooled())])
        classes = [["class", "points", "called rain", "of those it is sure of"]]
        sure = self._sure.by_class()
        for name, counts in self._all.by_class().items():
            if counts.points:
                of_sure = number_text(sure[name].share_lost, ".2%")
                title = f"{name} (rain)" if counts.rain else name
                classes.append([title, f"{counts.points:,}", f"{counts.share_lost:.2%}", of_sure])
        return f"{plain_table(scores)}\n{plain_table(classes)}"


def _scores(counts: Counts) -> list[str]:
    points = sum(astuple(counts))
    return [f"{points:,}", *map(number_text, (counts.precision, counts.recall, counts.iou))]
