"""Labels recordings by a method, and counts what it labels."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import astuple, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from derain.annotation.manifest import HELD_OUT_PART, Manifest
from derain.annotation.teach import TAUGHT_CARD, teach
from derain.cards.card import DataCard
from derain.errors import InputError
from derain.evaluation.answers import Answers
from derain.evaluation.rain_counts import RainCounts
from derain.evaluation.text_tables import number_text, plain_table
from derain.scan import Scan
from derain.sources.frame import Frame
from derain.sources.judging import Answer, Guard, unguarded
from derain.sources.method import Method
from derain.sources.reader import FrameReader
from derain.sources.recordings import irregularities
from derain.sources.source import Source
from derain.system.notices import Notices, warn
from derain.views.morton import first_rows
from derain.views.scan_issues import much_removed

# Which points of a scan of N points, bool (N,).
Mask = NDArray[np.bool_]

# What a teacher's answers are measured on.
OF_TEACHER = ("all points", "points it is sure of")


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
        if record is not None and frames[frame.key].has_labels:
            of_all = judgement.rain, np.ones_like(judgement.rain)
            of_sure = judgement.rain, judgement.answered
            try:
                record.add(frames[frame.key], judgement.scan, of_all, of_sure)
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
