"""Measures teacher and student on held-out scans: side by side, and beside persistence."""

from collections.abc import Callable, Container
from itertools import compress

import numpy as np
from tqdm import tqdm

from derain.annotation.teach import TAUGHT_CARD, labels_of
from derain.datamodules.taught import Taught
from derain.evaluation.answers import RAIN, Answers, answer_of
from derain.pictures.scan_pictures import before_after_figure, save
from derain.recordings.persistence import PersistenceDerainer
from derain.scan import Bools, Scan
from derain.sources.frame import Frame
from derain.sources.judging import Failures, judgements
from derain.sources.source import Source
from derain.sources.spread import evenly_spaced
from derain.workflows.learn_report import LearnResults

# Returns which points of a scan of N points are rain, bool (N,).
Student = Callable[[Scan], Bools]

# Held-out scans measured, and of these drawn.
MOST_EVALUATED = 50
DRAWN = 3


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
            rain = answer_of(data.reader.read(taught[frame.key]), data.card) == RAIN
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


def evaluate_student(results: LearnResults, data: Taught, student: Student) -> None:
    """Measures a student on held-out scans, and draws some of them.

    Args:
        results: Takes the answers, and the pictures, which lie beside the report.
        data: The scans with the teacher's labels.
        student: The finished model.

    Raises:
        InputError: A scan that cannot be read, or a picture that cannot be written.
    """
    frames = evenly_spaced(data.frames("validation"), MOST_EVALUATED)
    results.agreement = Answers()
    for frame in tqdm(frames, "evaluating", disable=None):
        scan = data.reader.read_measured(frame)
        results.agreement += Answers.of(scan, data.card, student(scan))
    for number, frame in enumerate(evenly_spaced(data.frames("validation"), DRAWN), 1):
        scan = data.reader.read(frame)
        picture = results.path.with_name(f"held_out_{number}.png")
        heading = f"{frame.key}, held out: cleaned by {results.student}"
        save(before_after_figure(scan, student(scan), heading), picture)
        results.pictures[picture] = f"{frame.key} before and after"
