"""Measures teacher and student on held-out scans: side by side, beside persistence, by labels."""

from collections.abc import Callable, Container, Sequence
from dataclasses import replace
from itertools import compress

import numpy as np
from tqdm import tqdm

from derain.annotation.teach import TAUGHT_CARD, labels_of
from derain.cards.card import DataCard, load_card
from derain.cards.known import label_of, layouts_for
from derain.datamodules.taught import Taught
from derain.errors import InputError
from derain.evaluation.answers import NOT_KNOWN, RAIN, Answers, TruthRecord, answer_of
from derain.evaluation.counts import SCORES
from derain.evaluation.text_tables import markdown_table, number_text
from derain.pictures.scan_pictures import before_after_figure, save
from derain.recordings.persistence import PersistenceDerainer
from derain.scan import Bools, Scan
from derain.sources.bag_frame import BagFrame
from derain.sources.file_frame import FileFrame
from derain.sources.frame import Frame
from derain.sources.judging import Failures, judgements
from derain.sources.reader import FrameReader
from derain.sources.source import Source
from derain.sources.spread import evenly_spaced
from derain.workflows.learn_report import LearnResults

# Returns which points of a scan of N points are rain, bool (N,).
Student = Callable[[Scan], Bools]

# Held-out scans measured, and of these drawn.
MOST_EVALUATED = 50
DRAWN = 3

SURE = "teacher, where it is sure"


def beside_persistence(data: Taught, recording: Source) -> Answers:
    """Persistence's answers on held-out scans, and beside them what the teacher calls rain.

    Scans that cannot be read are left out.

    Args:
        data: The scans with the teacher's labels.
        recording: The same scans as the teacher saw them, in time order, with their poses where
            these are known.
    """
    taught = {frame.key: frame for frame in data.frames("validation")[:MOST_EVALUATED]}
    shown = tqdm(_with_neighbours(recording, taught), "comparing", disable=None)
    found = Answers()
    guard = Failures().skipping_failures
    for frame, judgement, _ in judgements(PersistenceDerainer(), shown, guard):
        if frame.key in taught:
            rain = answer_of(data.read(taught[frame.key]), data.card) == RAIN
            labelled = judgement.scan.with_label(labels_of(judgement))
            found += Answers.of(labelled, TAUGHT_CARD, rain)
    return found


def _with_neighbours(recording: Source, keys: Container[str]) -> list[Frame]:
    """The frames of some keys, and those right before and after them, without labels."""
    wanted = np.array([frame.key in keys for frame in recording], bool)
    seen = wanted.copy()
    seen[1:] |= wanted[:-1]
    seen[:-1] |= wanted[1:]
    return [frame.without_labels() for frame in compress(recording, seen)]


def evaluate_student(
    results: LearnResults, data: Taught, student: Student, card: str | None = None
) -> None:
    """Measures a student on held-out scans, and draws some of them.

    Args:
        results: Takes the answers, the pictures, which lie beside the report, and the scores.
        data: The scans with the teacher's labels.
        student: The finished model.
        card: Data card of the scans' own labels; None measures nothing by them.

    Raises:
        InputError: A scan that cannot be read, or a picture that cannot be written.
    """
    frames = evenly_spaced(data.frames("validation"), MOST_EVALUATED)
    results.agreement = Answers()
    for frame in tqdm(frames, "evaluating", disable=None):
        scan = data.read_measured(frame)
        results.agreement += Answers.of(scan, data.card, student(scan))
    for number, frame in enumerate(evenly_spaced(data.frames("validation"), DRAWN), 1):
        scan = data.read(frame)
        picture = results.path.with_name(f"held_out_{number}.png")
        heading = f"{frame.key}, held out: cleaned by {results.student}"
        save(before_after_figure(scan, student(scan), heading), picture)
        results.pictures[picture] = f"{frame.key} before and after"
    if card is not None:
        results.record = scores_by_labels(frames, data.card, card, student)


def scores_by_labels(frames: Sequence[Frame], taught: DataCard, name: str, student: Student) -> str:
    """Scores of teacher and student on held-out scans, by the labels that lie beside these.

    It runs when the model is finished: nothing follows from the scores.

    Args:
        frames: Held-out scans with the teacher's labels.
        taught: Data card of the teacher's labels.
        name: Data card of the labels that lie beside the scans.
        student: The finished model.

    Returns:
        Tables in Markdown; where the labels cannot be used, the reason.
    """
    try:
        record = TruthRecord(load_card(name), ("teacher", SURE, "student"))
        for frame in frames:
            _measure(record, frame, taught, student)
    except InputError as error:
        return f"Nothing could be measured: {error}"
    return _tables(record)


def _measure(record: TruthRecord, frame: Frame, taught: DataCard, student: Student) -> None:
    """Measures teacher and student by the labels that lie beside a scan."""
    assert isinstance(frame, FileFrame)  # taught scans lie in files
    scan = FrameReader(taught).read(frame)
    own = label_of(frame.path, layouts_for(record.card))
    if isinstance(frame, BagFrame):
        own = frame.label_beside_bag
    answer, every = answer_of(scan, taught), np.ones(len(scan), bool)
    found = answer == RAIN
    answers = (found, every), (found, answer != NOT_KNOWN), (student(scan), every)
    record.add(replace(frame, label_path=own), scan, *answers)


def _tables(record: TruthRecord) -> str:
    """Scores over the points of all scans, and the share of each class that is called rain."""
    scores = [
        [title, *(number_text(getattr(counted.pooled, score)) for score in SCORES)]
        for title, counted in record.counts.items()
    ]
    classes = record.rows_by_class("teacher", "student")
    return "\n\n".join(
        (
            f"Labels of {record.card.title} on the held-out scans, pooled over their points. They "
            "were read when the model was finished, and chose nothing.",
            markdown_table(("", "P", "R", "F1", "IoU"), scores),
            "Called rain, by class:",
            markdown_table(("class", "points", "teacher", "student"), classes),
        )
    )
