"""What a teacher says beside the truth: counted as whoever counts by hand would."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from derain.cards.card import DataCard
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.evaluation.truth_record import TruthRecord
from derain.scan import Scan
from derain.sources.frame import MemoryFrame

CARD = DataCard("yard", {0: "wall", 1: "drop", 2: "car", 9: "nobody knows"}, (1,), (9,))

#               called rain: 1     sure: 1
TRUTH = np.array([1, 1, 1, 1, 0, 0, 0, 2, 2, 9])
CALLED = np.array([1, 1, 0, 1, 0, 0, 1, 1, 0, 1], bool)
SURE = np.array([1, 0, 1, 1, 1, 1, 0, 1, 1, 1], bool)


EVERY = np.ones(len(TRUTH), bool)
FRAME = MemoryFrame(key="0", scan=Scan.of(scene(len(TRUTH))).with_label(TRUTH))


def record_of(card: DataCard, rows: NDArray[np.int64], sure: NDArray[np.bool_]) -> TruthRecord:
    """A record of one scan that has these rows of the points above."""
    record, scan = TruthRecord(card), FRAME.scan.take(rows)
    answers = (CALLED[rows], EVERY[rows]), (CALLED[rows], sure[rows])
    record.add(MemoryFrame(key="0", scan=scan), scan, *answers)
    return record


def test_all_points_and_sure_ones_are_counted_apart() -> None:
    rows = np.arange(len(TRUTH))
    lines = str(record_of(CARD, rows, SURE)).splitlines()
    # All: 4 drops, 3 found, 2 others called so. Sure: 3 drops, 2 found, 1 other.
    assert lines[1].split() == ["all", "points", "9", "0.600", "0.750", "0.500"]
    assert lines[2].split()[-4:] == ["7", "0.667", "0.667", "0.500"]
    assert [line.split() for line in lines[4:]] == [
        ["wall", "3", "33.33%", "0.00%"],
        ["drop", "(rain)", "4", "75.00%", "66.67%"],
        ["car", "2", "50.00%", "50.00%"],
    ]
    without_doubt = str(record_of(CARD, rows, EVERY)).splitlines()
    assert without_doubt[2].split()[-4:] == lines[1].split()[-4:]


def test_points_at_one_position_count_once_where_the_card_says_so() -> None:
    twice = np.tile(np.arange(len(TRUTH)), 2)
    for card, points in ((CARD, "18"), (replace(CARD, deduplicate=True), "9")):
        assert str(record_of(card, twice, SURE)).splitlines()[1].split()[2] == points


def test_strange_labels_are_refused() -> None:
    record, strange = TruthRecord(CARD), FRAME.scan.with_label(TRUTH * 0 + 7)
    with pytest.raises(InputError, match=r"ids \[7\] are no classes of yard"):
        record.add(MemoryFrame(key="0", scan=strange), strange, (CALLED, EVERY), (CALLED, SURE))
    assert record.scans == 0
