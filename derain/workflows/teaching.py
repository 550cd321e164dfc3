"""Labels recordings by a method, and counts what it labels."""

from dataclasses import dataclass
from pathlib import Path

from derain.annotation.manifest import HELD_OUT_PART, Manifest
from derain.annotation.teach import LabelledScan, Watch, teach
from derain.cards.card import DataCard
from derain.evaluation.answers import Answers, TruthRecord
from derain.jobs.running import Submits
from derain.sources.judging import Guard, unguarded
from derain.sources.method import Method
from derain.sources.recordings import irregularities
from derain.sources.source import Source
from derain.sources.units import Division
from derain.system.notices import Notices, warn


@dataclass(frozen=True)
class TeachResults:
    """The labels of recordings, or of a shard of them.

    Attributes:
        manifest: The labelled scans, as written; not finished while other shards are to be done.
        judged: Number of judged scans; those of which nothing is known have no labels.
        answers: Counts of the labels by range.
        record: Scores by the scans' own labels; None where there is no card.
    """

    manifest: Manifest
    judged: int
    answers: Answers
    record: TruthRecord | None

    @property
    def held_out(self) -> int:
        """Number of labelled scans that are held out."""
        return sum(scan.part == HELD_OUT_PART for scan in self.manifest.scans)


def teach_recordings(
    method: Method,
    source: Source,
    out: Path,
    *,
    card: DataCard | None = None,
    guard: Guard = unguarded,
    watch: Watch = lambda scan: None,
    division: Division | None = None,
    executor: Submits | None = None,
) -> TeachResults:
    """Labels recordings by a method, and warns where a network could learn little from the labels.

    Args:
        method: The teacher.
        source: Scans in files, in time order, one sequence after the other.
        out: Folder of the labels, as :func:`derain.annotation.teach.teach` writes it.
        card: Data card of the scans, whose own labels measure the teacher's; they change nothing.
        guard: Surrounds the work on each scan; one whose error it holds back gets no labels.
        watch: Receives each scan.
        division: Division of the scans into units; see :func:`derain.annotation.teach.teach`.
        executor: Does the units; None does them in this process.

    Raises:
        InputError: As for :func:`derain.annotation.teach.teach`.
    """
    for sentence in irregularities(source, method.window):
        warn(sentence)
    record = None if card is None else TruthRecord(card)
    notices, judged, counts = Notices(), 0, Answers()

    def count(scan: LabelledScan) -> None:
        nonlocal judged, counts
        judged += 1
        counts += scan.answers
        notices.warn(scan.frame.name, scan.issues)
        if record is not None and scan.truth is not None:
            record.add_cells(scan.truth)
        watch(scan)

    manifest = teach(method, source, out, card, guard, count, division, executor)
    notices.warn_of_repeats()
    results = TeachResults(manifest, judged, counts, record)
    if division is None or division.shard is None:
        _warn_of_little(results)
    return results


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
