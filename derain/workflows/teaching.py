"""Labels recordings by a method, and counts what it labels."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from derain.annotation.manifest import HELD_OUT_PART, Manifest
from derain.annotation.taught_labels import TAUGHT_CARD
from derain.annotation.teach import teach
from derain.annotation.truth import TruthRecord
from derain.cards.card import DataCard
from derain.errors import InputError
from derain.evaluation.answers import Answers
from derain.sources.judging import Answer, Guard, unguarded
from derain.sources.method import Method
from derain.sources.recordings import irregularities
from derain.sources.source import Source
from derain.system.notices import Notices, warn
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
    record: TruthRecord | None

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
    counting = _Counting(method, source, card, watch)
    manifest = teach(method, source, out, card, guard, counting.add)
    counting.notices.warn_of_repeats()
    results = TeachResults(manifest, counting.judged, counting.answers, counting.record)
    _warn_of_little(results)
    return results


class _Counting:
    """Counts labels scan by scan, and warns of what is odd."""

    def __init__(self, method: Method, source: Source, card: DataCard | None, watch: Watch) -> None:
        self.method = method
        self.frames = {frame.key: frame for frame in source}
        self.watch = watch
        self.judged = 0
        self.answers = Answers.none()
        self.notices = Notices()
        measured = card is not None and any(frame.has_labels for frame in source)
        self.record = TruthRecord(card) if card is not None and measured else None

    def add(self, answer: Answer, labels: NDArray[np.uint32]) -> None:
        """Counts one scan."""
        frame, judgement, stopwatch = answer
        self.judged += 1
        odd = [*self.method.issues(judgement), *much_removed(judgement.share_of_rain)]
        self.notices.warn(frame.name, odd)
        answers = Answers.of(judgement.scan.with_label(labels), TAUGHT_CARD)
        self.answers += answers
        self.watch(LabelledScan(frame.name, answers, dict(stopwatch.milliseconds)))
        if self.record is not None:
            try:
                self.record.add(self.frames[frame.key], judgement)
            except InputError as error:
                warn(f"not measured: {error}")


def _warn_of_little(results: TeachResults) -> None:
    if unlabelled := results.judged - len(results.manifest.scans):
        warn(f"{unlabelled:,} of {results.judged:,} scans are left out: nothing is known of them")
    if not results.answers.rain:
        warn("no rain was found: a network would learn that nothing is rain")
    if not results.held_out:
        warn("no scan is held out, for that a sequence needs three: all are for training")
