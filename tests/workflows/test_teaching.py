"""What a teacher says beside the truth: counted as whoever counts by hand would."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from derain.cards.card import DataCard
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.scan import Scan
from derain.sources.frame import MemoryFrame
from derain.sources.judgement import Judgement
from derain.workflows.teaching import TruthRecord

CARD = DataCard("yard", {0: "wall", 1: "drop", 2: "car", 9: "nobody knows"}, (1,), (9,))

#               called rain: 1     sure: 1
TRUTH = np.array([1, 1, 1, 1, 0, 0, 0, 2, 2, 9])
CALLED = np.array([1, 1, 0, 1, 0, 0, 1, 1, 0, 1], bool)
SURE = np.array([1, 0, 1, 1, 1, 1, 0, 1, 1, 1], bool)


def frame_and_judgement(known: NDArray[np.bool_] | None = SURE) -> tuple[MemoryFrame, Judgement]:
    scan = Scan.of(scene(len(TRUTH)))
    every = np.ones(len(TRUTH), bool)
    judgement = Judgement(CALLED.astype(np.float32), CALLED, every, scan, known=known)
    return MemoryFrame(key="0", scan=scan.with_label(TRUTH)), judgement


def test_all_points_and_sure_ones_are_counted_apart() -> None:
    record = TruthRecord(CARD)
    record.add(*frame_and_judgement())
    lines = str(record).splitlines()
    # All: 4 drops, 3 found, 2 others called so. Sure: 3 drops, 2 found, 1 other.
    assert lines[1].split() == ["all", "points", "9", "0.600", "0.750", "0.500"]
    assert lines[2].split()[-4:] == ["7", "0.667", "0.667", "0.500"]
    assert [line.split() for line in lines[4:]] == [
        ["wall", "3", "33.33%", "0.00%"],
        ["drop", "(rain)", "4", "75.00%", "66.67%"],
        ["car", "2", "50.00%", "50.00%"],
    ]
    without_doubt = TruthRecord(CARD)
    without_doubt.add(*frame_and_judgement(known=None))
    first, second = str(without_doubt).splitlines()[1:3]
    assert first.split()[-4:] == second.split()[-4:] == lines[1].split()[-4:]


def test_points_at_one_position_count_once_where_the_card_says_so() -> None:
    frame, judgement = frame_and_judgement()
    twice = np.tile(np.arange(len(TRUTH)), 2)
    doubled = Judgement(
        *(part[twice] for part in (judgement.probability, CALLED, judgement.judged)),
        scan=judgement.scan.take(twice),
        known=SURE[twice],
    )
    again = MemoryFrame(key="0", scan=frame.scan.take(twice))
    once, both = TruthRecord(replace(CARD, deduplicate=True)), TruthRecord(CARD)
    once.add(again, doubled)
    both.add(again, doubled)
    assert "all points" in str(once)
    assert str(once).splitlines()[1].split()[2] == "9"
    assert str(both).splitlines()[1].split()[2] == "18"


def test_scans_without_labels_are_left_out_and_strange_ones_refused() -> None:
    record = TruthRecord(CARD)
    frame, judgement = frame_and_judgement()
    record.add(frame.without_labels(), judgement)
    assert record.scans == 0
    with pytest.raises(InputError, match=r"ids \[7\] are no classes of yard"):
        record.add(replace(frame, scan=frame.scan.with_label(TRUTH * 0 + 7)), judgement)
    assert record.scans == 0
