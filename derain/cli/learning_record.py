"""How a finished model compares with labels beside its scans, where a user asks for that."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from derain.cards.card import DataCard, load_card
from derain.cards.known import label_of, layouts_for
from derain.errors import InputError
from derain.evaluation.answers import NOT_KNOWN, RAIN, answer_of
from derain.evaluation.counts import SCORES
from derain.evaluation.rain_counts import RainCounts
from derain.evaluation.text_tables import markdown_table, number_text
from derain.scan import Scan
from derain.sources.bag_frame import BagFrame
from derain.sources.file_frame import FileFrame
from derain.sources.frame import Frame
from derain.sources.reader import FrameReader
from derain.views.morton import first_rows

Student = Callable[[Scan], NDArray[np.bool_]]

SURE = "teacher, where it is sure"


def record_of(frames: Sequence[Frame], taught: DataCard, name: str, student: Student) -> str:
    """Scores of teacher and student on held-out scans, by the labels that lie beside these.

    It is called when the model is finished: nothing follows from what it finds.

    Args:
        frames: Held-out scans with the teacher's labels.
        taught: Data card of the teacher's labels.
        name: Data card of the labels that lie beside the scans.
        student: Says which points of a scan are rain, bool (N,).

    Returns:
        Tables in Markdown; where the labels cannot be used, the reason.
    """
    try:
        card = load_card(name)
        return _tables(card, _measured(frames, taught, card, student))
    except InputError as error:
        return f"Nothing could be measured: {error}"


def _measured(
    frames: Sequence[Frame], taught: DataCard, card: DataCard, student: Student
) -> dict[str, RainCounts]:
    """Teacher and student beside the labels, over all points and where the teacher is sure."""
    titles = ("teacher", SURE, "student")
    metrics = {t: RainCounts(card.classes, card.rain, unknown=card.unknown) for t in titles}
    reader, layouts = FrameReader(taught), layouts_for(card)
    for frame in frames:
        assert isinstance(frame, FileFrame)  # what is taught lies in files
        scan = reader.read(frame)
        answer, called_rain = answer_of(scan, taught), student(scan)
        own = (
            frame.label_beside_bag if isinstance(frame, BagFrame) else label_of(frame.path, layouts)
        )
        labelled = replace(frame, label_path=own).read_label(len(scan))
        rows = first_rows(scan) if card.deduplicate else np.flatnonzero(scan.valid)
        sure = rows[answer[rows] != NOT_KNOWN]
        truth = scan.with_label(labelled)
        metrics["teacher"].add(truth.take(rows), answer[rows] == RAIN)
        metrics[SURE].add(truth.take(sure), answer[sure] == RAIN)
        metrics["student"].add(truth.take(rows), called_rain[rows])
    return metrics


def _tables(card: DataCard, metrics: Mapping[str, RainCounts]) -> str:
    """Scores over the points of all scans, and what was called rain of each class."""
    scores = [
        [title, *(number_text(getattr(measured.pooled(), score)) for score in SCORES)]
        for title, measured in metrics.items()
    ]
    of_classes = {title: measured.by_class() for title, measured in metrics.items()}
    called = [
        [
            name + " (rain)" * of_class.rain,
            f"{of_class.points:,}",
            *(f"{of_classes[title][name].share_lost:.2%}" for title in ("teacher", "student")),
        ]
        for name, of_class in of_classes["student"].items()
        if of_class.points
    ]
    return "\n\n".join(
        (
            f"Labels of {card.title}, held-out scans alone, pooled over their points. They were "
            "read when the model was finished, and chose nothing.",
            markdown_table(("", "P", "R", "F1", "IoU"), scores),
            "Called rain, by class:",
            markdown_table(("class", "points", "teacher", "student"), called),
        )
    )
