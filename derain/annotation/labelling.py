"""Labels the scans of one unit by a method, and counts the labels."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from derain.annotation.manifest import label_path
from derain.cards.card import DataCard
from derain.errors import InputError
from derain.evaluation.answers import NOT_KNOWN, TEACHERS_ANSWERS, Answers
from derain.evaluation.truth_record import TruthRecord
from derain.files.labels import write_labels
from derain.jobs.running import IsThere
from derain.sources.frame import Frame
from derain.sources.judgement import Judgement
from derain.sources.unit_judging import UnitJudging
from derain.sources.units import FrameUnit
from derain.system.stopwatch import Stopwatch
from derain.views.scan_issues import ScanIssue, much_removed

# Class ids of a teacher's answers.
TAUGHT_NOT_RAIN, TAUGHT_RAIN, TAUGHT_UNKNOWN = 0, 1, 255
TAUGHT_CLASSES = (TAUGHT_NOT_RAIN, TAUGHT_RAIN, TAUGHT_UNKNOWN)
TAUGHT_CARD = DataCard(
    "taught",
    classes=dict(zip(TAUGHT_CLASSES, TEACHERS_ANSWERS.values(), strict=True)),
    rain=(TAUGHT_RAIN,),
    unknown=(TAUGHT_UNKNOWN,),
)


@dataclass(frozen=True)
class LabelledScan:
    """The labels of one scan, counted.

    Attributes:
        frame: The scan.
        answers: Counts of its labels.
        milliseconds: Time of each stage.
        truth: Its points by their own labels, as :attr:`derain.evaluation.RainCounts.cells` for
            each title of a :class:`TruthRecord`; None where they are not measured.
        issues: What is odd about it.
        error: Why it has no labels; None where it has.
    """

    frame: Frame
    answers: Answers = field(default_factory=Answers.none)
    milliseconds: Mapping[str, float] = field(default_factory=dict)
    truth: Sequence[NDArray[np.int64]] | None = None
    issues: Sequence[ScanIssue] = ()
    error: InputError | None = None

    @property
    def name(self) -> str:
        """File of the scan."""
        return self.frame.name

    @property
    def is_known(self) -> bool:
        """Whether anything is known of it."""
        return bool(self.answers.table[:, :NOT_KNOWN].any())

    def to_json(self) -> dict[str, Any]:
        """The counts as the record of the scan's unit has them."""
        return {
            "key": self.frame.key,
            "number": self.frame.number,
            "answers": self.answers.table.tolist(),
            "milliseconds": dict(self.milliseconds),
            "truth": None if self.truth is None else [cells.tolist() for cells in self.truth],
        }


@dataclass(frozen=True)
class Labelling(UnitJudging[LabelledScan]):
    """Labels the scans of one unit after the other, also those of which nothing is known.

    Attributes:
        folder: Where the labels go, as of :func:`derain.annotation.manifest.label_path`.
        card: Data card of the scans, whose own labels measure the method's; None where there is
            none.
    """

    folder: Path
    card: DataCard | None

    def do(self, unit: FrameUnit) -> Iterator[LabelledScan]:
        """Labels the scans of a unit."""
        placed, doubts = self.placed(unit)
        for labelled in self.results(placed.of(_without_labels), partial(self._labelled, placed)):
            issues = [*doubts.get(labelled.frame.key, ()), *labelled.issues]
            yield replace(labelled, issues=issues)

    def look(self) -> IsThere[FrameUnit, LabelledScan]:
        """Whether all scans of a unit have labels."""
        return lambda unit, labelled: all(
            label_path(self.folder, frame.key).exists() for frame in unit.frames
        )

    def failure(self, frame: Frame, error: InputError) -> LabelledScan:
        """The result of a scan that has no labels."""
        return LabelledScan(frame, error=error)

    def from_json(self, unit: FrameUnit, written: dict[str, Any]) -> LabelledScan:
        """The counts of a scan from its record."""
        truth = written["truth"]
        return LabelledScan(
            replace(unit.by_key[written["key"]], number=written["number"]),
            Answers(np.array(written["answers"], np.int64)),
            written["milliseconds"],
            None if truth is None else [np.array(cells, np.int64) for cells in truth],
        )

    def _labelled(
        self, unit: FrameUnit, unlabelled: Frame, judgement: Judgement, stopwatch: Stopwatch
    ) -> LabelledScan:
        frame, labels = unit.by_key[unlabelled.key], labels_of(judgement)
        write_labels(label_path(self.folder, frame.key), labels)
        issues = [*self.method.issues(judgement), *much_removed(judgement.share_of_rain)]
        truth = None
        if self.card is not None and frame.has_labels:
            try:
                truth = _measured(self.card, frame, judgement)
            except InputError as error:
                issues.append(ScanIssue("own labels not measured", f"not measured: {error}"))
        answers = Answers.of(judgement.scan.with_label(labels), TAUGHT_CARD)
        return LabelledScan(frame, answers, dict(stopwatch.milliseconds), truth, issues)


def _without_labels(frames: Sequence[Frame]) -> list[Frame]:
    return [frame.without_labels() for frame in frames]


def labels_of(judgement: Judgement) -> NDArray[np.uint32]:
    """The labels of each row of a judged scan, uint32 (N,), as they are written.

    Rows of which the method is not sure, which it did not see or which hold no return are unknown.
    """
    labels = np.where(judgement.rain, np.uint32(TAUGHT_RAIN), np.uint32(TAUGHT_NOT_RAIN))
    labels[~(judgement.answered & judgement.scan.valid)] = TAUGHT_UNKNOWN
    return labels


def _measured(card: DataCard, frame: Frame, judgement: Judgement) -> list[NDArray[np.int64]]:
    """Counts the answers to a scan by its own labels, first of all points, then of sure ones."""
    record = TruthRecord(card)
    of_all = judgement.rain, np.ones_like(judgement.rain)
    of_sure = judgement.rain, judgement.answered
    record.add(frame, judgement.scan, of_all, of_sure)
    return [counts.cells for counts in record.counts.values()]
