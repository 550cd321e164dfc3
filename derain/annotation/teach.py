"""Labels recordings by a method, and writes the labels, their data card and their manifest."""

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray
from tqdm import tqdm

from derain.annotation.manifest import (
    CARD,
    HELD_OUT_PART,
    LABELS,
    TAUGHT_MANIFEST,
    Manifest,
    TaughtScan,
    is_taught,
    label_path,
    parts_of,
)
from derain.cards.card import DataCard
from derain.errors import InputError
from derain.evaluation.answers import NOT_KNOWN, TEACHERS_ANSWERS, Answers, TruthRecord
from derain.files.atomic import write_text
from derain.files.labels import LABEL, write_labels
from derain.jobs.job import FOLDER
from derain.jobs.running import IsThere, Submits, Task, completed, run
from derain.scan import Ints
from derain.sources.file_frame import FileFrame
from derain.sources.frame import Frame
from derain.sources.judgement import Judgement
from derain.sources.judging import Guard, unguarded
from derain.sources.method import Method
from derain.sources.recordings import irregularities
from derain.sources.sink import FolderSink
from derain.sources.source import Source
from derain.sources.unit_judging import UnitJudging
from derain.sources.units import Division, FrameUnit, units_of, whole
from derain.stores.documents import documents_at
from derain.system.notices import Notices, warn
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
        truth: Its points by their own labels, as
            :attr:`derain.evaluation.counts.RainCounts.cells` for each title of a
            :class:`TruthRecord`; None where they are not measured.
        issues: Warnings about it.
        error: Why it has no labels; None where it has.
    """

    frame: Frame
    answers: Answers = field(default_factory=Answers)
    milliseconds: Mapping[str, float] = field(default_factory=dict)
    truth: Sequence[Ints] | None = None
    issues: Sequence[ScanIssue] = ()
    error: InputError | None = None

    @property
    def is_known(self) -> bool:
        """True if anything is known of it."""
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
    """Labels the scans of one unit after the other, also those without any known point.

    Attributes:
        out: Folder of the teaching.
        card: Data card of the scans, whose own labels measure the method's; None where there is
            none.
    """

    out: Path
    card: DataCard | None

    def do(self, unit: FrameUnit) -> Iterator[LabelledScan]:
        """Labels the scans of a unit."""
        unlabelled = unit.of(lambda frames: [frame.without_labels() for frame in frames])
        yield from self.results(unlabelled, partial(self._labelled, unit))

    def look(self) -> IsThere[FrameUnit, LabelledScan]:
        """True if all scans of a unit have labels of which anything is known."""
        return lambda unit, labelled: all(
            label_path(self.out, scan.frame.key).exists() for scan in labelled if scan.is_known
        )

    def failure(self, frame: Frame, error: InputError) -> LabelledScan:
        """The result of a scan that has no labels."""
        return LabelledScan(frame, error=error)

    def from_json(self, unit: FrameUnit, written: dict[str, Any]) -> LabelledScan:
        """The counts of a scan from its record."""
        truth = written["truth"]
        return LabelledScan(
            replace(unit.by_key[written["key"]], number=written["number"]),
            Answers(np.array(written["answers"], np.int64).reshape(Answers().table.shape)),
            written["milliseconds"],
            None if truth is None else [np.array(cells, np.int64) for cells in truth],
        )

    def _labelled(
        self, unit: FrameUnit, unlabelled: Frame, judgement: Judgement, stopwatch: Stopwatch
    ) -> LabelledScan:
        frame, labels = unit.by_key[unlabelled.key], labels_of(judgement)
        issues = [*self.method.issues(judgement), *much_removed(judgement.share_of_rain)]
        truth = None
        if self.card is not None and frame.has_labels:
            try:
                truth = _measured(self.card, frame, judgement)
            except InputError as error:
                issues.append(ScanIssue("own labels not measured", f"not measured: {error}"))
        answers = Answers.of(judgement.scan.with_label(labels), TAUGHT_CARD)
        labelled = LabelledScan(frame, answers, dict(stopwatch.milliseconds), truth, issues)
        if labelled.is_known:
            write_labels(label_path(self.out, frame.key), labels)
        return labelled


@dataclass
class TeachResults:
    """The labels of recordings, or of a shard of them.

    Attributes:
        manifest: The labelled scans, as written; not finished while other shards are to be done.
        judged: Number of judged scans; those of which nothing is known have no labels.
        answers: Counts of the labels by range.
        record: Scores by the scans' own labels; None where there is no card.
    """

    manifest: Manifest
    judged: int = 0
    answers: Answers = field(default_factory=Answers)
    record: TruthRecord | None = None

    @property
    def held_out(self) -> int:
        """Number of labelled scans that are held out."""
        return sum(scan.part == HELD_OUT_PART for scan in self.manifest.scans)

    def add(self, scan: LabelledScan) -> None:
        """Counts a judged scan."""
        self.judged += 1
        self.answers += scan.answers
        if self.record is not None and scan.truth is not None:
            self.record.add_cells(scan.truth)


# Receives each labelled scan.
Watch = Callable[[LabelledScan], None]


def teach(
    method: Method,
    source: Source,
    out: Path,
    card: DataCard | None = None,
    guard: Guard = unguarded,
    watch: Watch = lambda scan: None,
    division: Division | None = None,
    executor: Submits | None = None,
) -> TeachResults:
    """Labels recordings: 0 is not rain, 1 rain, 255 not known.

    Labels of the scans never change the result. Scans of which nothing is known are left out: they
    neither train nor measure a student. Until every scan is judged, the manifest is marked as not
    finished, and nobody can read it. Labels from which a network could learn little are warned of.

    Args:
        method: The teacher.
        source: Scans in files, in time order, one sequence after the other.
        out: Folder to write: a new one, or one of an earlier teaching. It gets the labels, their
            data card, and a manifest with the paths of the scans.
        card: Data card of the scans, from which the new one takes licence and unit, and by which
            the scans' own labels measure the teacher's.
        guard: Surrounds the error of each scan; a scan whose error it suppresses gets no labels.
        watch: Called for each scan as soon as it is judged, in order.
        division: Division of the scans into units. Where there are more scans than a block has,
            a record of each unit is kept in the folder, by which a teaching that was stopped goes
            on. None keeps no records.
        executor: Does the units: an executor of :mod:`concurrent.futures` or the like, whose
            processes find all files by the same paths. None does them in this process.

    Raises:
        InputError: Scans that are in no files, or whose paths are not UTF-8; a folder that holds
            something else, or in which the scans' own labels are; a scan that cannot be read or
            judged, unless the guard suppresses the error; no point of which anything is known;
            records of other options in the folder; an executor that has ended.
    """
    refuse_to_overwrite(out, source)
    for sentence in irregularities(source, method.window):
        warn(sentence)
    # Absolute, because other processes may work in another folder.
    work = Labelling(method, method.fingerprint(), out.absolute(), card)
    record = None if card is None else TruthRecord(card)
    results = TeachResults(Manifest(method.as_dict(), finished=False), record=record)
    units = shard = [whole(source)]
    job = None
    if division is not None and division.keeps_records(source, out):
        options = work.options("teach", source, division.block)
        options["card"] = None if card is None else card.name
        units = units_of(source, method, division.block)
        job, shard = division.begin(work.out, options, units)
    elif is_taught(out):
        documents_at(work.out, FOLDER).remove_all()  # records of labels that are replaced now
    results.manifest.write(out)
    task = Task(job, work)
    judged = (result for _, result, _ in run(task, shard, executor if job else None))
    known = _known(judged, sum(len(unit.frames) for unit in shard), guard, watch, results)
    if division is not None and division.shard is not None:
        scans = completed(task, units)
        if scans is not None:
            known = [scan.frame for scan in scans if scan.is_known]
            results.manifest = _finish(work, out, known)
        return results
    results.manifest = _finish(work, out, known)
    _warn_of_little(results)
    return results


def _known(
    scans: Iterator[LabelledScan], total: int, guard: Guard, watch: Watch, results: TeachResults
) -> list[Frame]:
    """The frames with known points, after all scans are labelled and counted."""
    frames: list[Frame] = []
    notices = Notices()
    for scan in tqdm(scans, total=total, desc="teaching", unit="scan", disable=None):
        if scan.error is not None:
            with guard(scan.frame):
                raise scan.error
        else:
            results.add(scan)
            notices.warn(scan.frame.name, scan.issues)
            watch(scan)
            if scan.is_known:
                frames.append(scan.frame)
    notices.warn_of_repeats()
    return frames


def _warn_of_little(results: TeachResults) -> None:
    if unlabelled := results.judged - len(results.manifest.scans):
        warn(
            f"{unlabelled:,} of {results.judged:,} scans are left out: "
            "the method is sure of none of their points"
        )
    if not results.answers.rain:
        warn("no rain was found: a network would learn that nothing is rain")
    if not results.held_out:
        warn("no scan is held out, which takes three scans of a sequence: all are for training")


def _finish(work: Labelling, out: Path, known: Sequence[Frame]) -> Manifest:
    """Removes labels of earlier teachings, and writes the card and the manifest.

    Two commands that do the last shards may do it at once.

    Raises:
        InputError: Nothing is known of any scan.
    """
    frames = [frame for frame in known if isinstance(frame, FileFrame)]  # all are in files
    if not frames:
        reason = (
            "no labels are written, because in every scan the method fails or is sure of no point"
        )
        remedy = "Check that the method suits the scans: some need several scans of one recording."
        raise InputError(out, reason, remedy)
    manifest = Manifest(
        work.method.as_dict(),
        [
            TaughtScan(frame.key, frame.path, frame.sequence, frame.number, part)
            for frame, part in zip(frames, parts_of(frames), strict=True)
        ],
        frames[0].columns,
        frames[0].intensity_scale,
    )
    labels = {label_path(out, scan.key) for scan in manifest.scans}
    for written in (out / LABELS).rglob(f"*{LABEL}"):
        if written not in labels:
            written.unlink(missing_ok=True)
    write_card(out / CARD, Path(manifest.teacher["method"]).stem, work.card)
    manifest.write(out)
    return manifest


def write_card(path: Path, teacher: str, scans: DataCard | None) -> None:
    """Writes the data card of a teacher's labels; training measures its statistics.

    Args:
        path: The file.
        teacher: Name of the teacher.
        scans: Data card of the scans, which gives their licence, their unit, and whether points at
            one position count once; None where there is none.

    Raises:
        InputError: It cannot be written.
    """
    card: dict[str, Any] = {
        "name": f"{'scans' if scans is None else scans.name} taught by {teacher}",
        "classes": dict(TAUGHT_CARD.classes),
        "rain": [*TAUGHT_CARD.rain],
        "unknown": [*TAUGHT_CARD.unknown],
        "licence": f"derived from scans whose licence is {(scans or TAUGHT_CARD).licence}",
    }
    if scans is not None:
        for name in ("intensity_unit", "simulated", "deduplicate"):
            card[name] = getattr(scans, name)
    write_text(path, yaml.safe_dump(card, sort_keys=False, allow_unicode=True))


def refuse_to_overwrite(out: Path, source: Source) -> None:
    """Refuses, before any work, a folder or scans that cannot be taught.

    Raises:
        InputError: As for :func:`teach`.
    """
    for frame in source:
        if not isinstance(frame, FileFrame):
            reason = "is not in a file, and cannot be found again"
            raise InputError(frame.name, reason, "Write it to one.")
        try:
            f"{os.path.realpath(frame.path)} {frame.sequence}".encode()
        except UnicodeEncodeError as error:
            reason = "its path is not UTF-8, and the manifest could not hold it"
            raise InputError(frame.name, reason, "Rename its file or folder.") from error
    # Refuses the places where the scans' own labels are or would be searched for.
    FolderSink(out / LABELS).refuse_clashes(source)
    if is_taught(out):
        return
    for name in (TAUGHT_MANIFEST, CARD, LABELS):
        if os.path.lexists(out / name):
            reason = "exists, and `derain teach` did not write it"
            raise InputError(out / name, reason, "Give --out another folder.")


def labels_of(judgement: Judgement) -> NDArray[np.uint32]:
    """The labels of each row of a judged scan, uint32 (N,), as they are written.

    Rows of which the method is not sure, which it did not see or which hold no return are unknown.
    """
    labels = np.where(judgement.rain, np.uint32(TAUGHT_RAIN), np.uint32(TAUGHT_NOT_RAIN))
    labels[~(judgement.answered & judgement.scan.valid)] = TAUGHT_UNKNOWN
    return labels


def _measured(card: DataCard, frame: Frame, judgement: Judgement) -> list[Ints]:
    """Counts the answers to a scan by its own labels, first of all points, then of sure ones."""
    record = TruthRecord(card)
    of_all = judgement.rain, np.ones_like(judgement.rain)
    of_sure = judgement.rain, judgement.answered
    record.add(frame, judgement.scan, of_all, of_sure)
    return [counts.cells for counts in record.counts.values()]
