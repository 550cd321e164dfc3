"""How far a teacher is from the truth, for the record: nothing that it says depends on this."""

from derain.cards.card import DataCard
from derain.errors import InputError
from derain.evaluation.counts import Counts
from derain.evaluation.rain_counts import RainCounts
from derain.evaluation.text_tables import number_text, plain_table
from derain.sources.frame import Frame
from derain.sources.judgement import Judgement
from derain.views.morton import first_rows


class TruthRecord:
    """Measures what a teacher said of scans beside their own labels, where they have any.

    Args:
        card: Data card of the scans, which says what of them is rain.

    Attributes:
        scans: How many scans had labels.
    """

    def __init__(self, card: DataCard) -> None:
        self.card = card
        self.scans = 0
        self._all, self._sure = (
            RainCounts(card.classes, card.rain, unknown=card.unknown) for _ in range(2)
        )

    def add(self, frame: Frame, judgement: Judgement) -> None:
        """Measures one scan; where it has no labels, nothing is done.

        Args:
            frame: The scan's frame, with its own labels.
            judgement: What the teacher said of it.

        Raises:
            InputError: Labels that cannot be read, or that the data card does not know.
        """
        if not frame.has_labels:
            return
        scan = judgement.scan
        label = frame.read_label(len(scan))
        if strange := sorted({*label.tolist()} - self.card.classes.keys()):
            raise InputError(
                frame.label_path or frame.name,
                f"ids {strange[:5]} are no classes of {self.card.name}",
                "Name them in the data card.",
            )
        rows = first_rows(scan) if self.card.deduplicate else scan.valid.nonzero()[0]
        self._all.add(scan.with_label(label).take(rows), judgement.rain[rows])
        sure = rows[judgement.answered[rows]]
        self._sure.add(scan.with_label(label).take(sure), judgement.rain[sure])
        self.scans += 1

    def __str__(self) -> str:
        scores = [["", "points", "precision", "recall", "IoU"]]
        for name, metrics in (("all points", self._all), ("points it is sure of", self._sure)):
            scores.append([name, *_scores(metrics.pooled())])
        classes = [["class", "points", "called rain", "of those it is sure of"]]
        sure = self._sure.by_class()
        for name, counts in self._all.by_class().items():
            if counts.points:
                of_sure = number_text(sure[name].share_lost, ".2%")
                title = f"{name} (rain)" if counts.rain else name
                classes.append([title, f"{counts.points:,}", f"{counts.share_lost:.2%}", of_sure])
        return f"{plain_table(scores)}\n{plain_table(classes)}"


def _scores(counts: Counts) -> list[str]:
    points = sum((counts.true_positive, counts.false_positive, counts.false_negative))
    points += counts.true_negative
    return [f"{points:,}", *map(number_text, (counts.precision, counts.recall, counts.iou))]
