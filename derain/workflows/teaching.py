"""Labels recordings by a method, and counts what it labels."""

from collections.abc import Callable, Mapping
from dataclasses import astuple, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from derain.annotation.manifest import HELD_OUT_PART, Manifest
from derain.annotation.teach import TAUGHT_CARD, teach
from derain.cards.card import DataCard
from derain.errors import InputError
from derain.evaluation.answers import Answers
from derain.evaluation.counts import Counts
from derain.evaluation.rain_counts import RainCounts
from derain.evaluation.text_tables import number_text, plain_table
from derain.sources.frame import Frame
from derain.sources.judgement import Judgement
from derain.sources.judging import Answer, Guard, unguarded
from derain.sources.method import Method
from derain.sources.reader import FrameReader
from derain.sources.recordings import irregularities
from derain.sources.source import Source
from derain.system.notices import Notices, warn
from derain.views.morton import first_rows
from derain.views.scan_issues import much_removed


@dataclass(frozen=True)
class LabelledScan:
    """The labels of one scan, counted.

    Attributes:
        name: File of the scan.
        answers: Counts of its labels.
        milliseconds: Time of each stage.
    """

    name: str
    answers: Answers
    milliseconds: Mapping[str, float]


# Receives each scan as soon as it is labelled.
Watch = Callable[[LabelledScan], None]


@dataclass(frozen=True)
class TeachResults:
    """The labels of recordings.

    Attributes:
        manifest: The labelled scans, as written.
        judged: How many scans were judged; those of which nothing is known have no labels.
        answers: Counts of the labels by range.
        record: Scores by the scans' own labels; None where there is no card or there are no labels.
    """

    manifest: Manifest
    judged: int
    answers: Answers
    record: "TruthRecord | None"

    @property
    def held_out(self) -> int:
        """How many of the labelled scans are held out."""
        return sum(scan.part == HELD_OUT_PART for scan in self.manifest.scans)


def teach_recordings(
    method: Method,
    source: Source,
    out: Path,
    *,
    card: DataCard | None = None,
    guard: Guard = unguarded,
    watch: Watch = lambda scan: None,
) -> TeachResults:
    """Labels recordings by a method, and warns where a network could learn little from the labels.

    Args:
        method: The teacher.
        source: Scans in files, in time order, one sequence after the other.
        out: Folder of the labels, as :func:`derain.annotation.teach.teach` writes it.
        card: Data card of the scans, whose own labels measure the teacher's; they change nothing.
        guard: Surrounds the work on each scan; one whose error it holds back gets no labels.
        watch: Receives each scan.

    Raises:
        InputError: As for :func:`derain.annotation.teach.teach`.
    """
    for sentence in irregularities(source, method.window):
        warn(sentence)
    frames = {frame.key: frame for frame in source}
    measured = card is not None and any(frame.has_labels for frame in source)
    record = TruthRecord(card) if card is not None and measured else None
    notices, judged, counts = Notices(), 0, Answers.none()

    def count(answer: Answer, labels: NDArray[np.uint32]) -> None:
        nonlocal judged, counts
        frame, judgement, stopwatch = answer
        judged += 1
        odd = [*method.issues(judgement), *much_removed(judgement.share_of_rain)]
        notices.warn(frame.name, odd)
        answers = Answers.of(judgement.scan.with_label(labels), TAUGHT_CARD)
        counts += answers
        watch(LabelledScan(frame.name, answers, dict(stopwatch.milliseconds)))
        if record is not None:
            try:
                record.add(frames[frame.key], judgement)
            except InputError as error:
                warn(f"not measured: {error}")

    manifest = teach(method, source, out, card, guard, count)
    notices.warn_of_repeats()
    results = TeachResults(manifest, judged, counts, record)
    _warn_of_little(results)
    return results


def _warn_of_little(results: TeachResults) -> None:
    if unlabelled := results.judged - len(results.manifest.scans):
        warn(f"{unlabelled:,} of {results.judged:,} scans are left out: nothing is known of them")
    if not results.answers.rain:
        warn("no rain was found: a network would learn that nothing is rain")
    if not results.held_out:
        warn("no scan is held out, for that a sequence needs three: all are for training")


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
