"""Answers of teacher and student are counted point by point, by range and beside the truth."""

from dataclasses import replace

import numpy as np
import pytest

from derain.cards.card import DataCard
from derain.evaluation.answers import (
    NOT_KNOWN,
    NOT_RAIN,
    RAIN,
    Answers,
    TruthRecord,
    answer_of,
)
from derain.evaluation.counts import RANGE_EDGES, Counts
from derain.evaluation.hard_cases import scene
from derain.scan import Bools, Ints, Scan
from derain.sources.frame import MemoryFrame


@pytest.fixture
def judged(scans) -> list[tuple[Scan, np.ndarray]]:
    """Labelled scans, with rows that cannot be judged, and what a student calls rain in them."""
    rng = np.random.default_rng(0)
    for scan in scans:
        scan.xyz[::50] = np.nan
        scan.xyz[7] = (300, 0, 0)
    return [(scan, rng.random(len(scan)) < 0.3) for scan in scans]


def test_every_point_that_can_be_judged_is_counted_once(judged, card) -> None:
    answers = sum((Answers.of(scan, card, called) for scan, called in judged), Answers())
    expected = np.zeros_like(answers.table)
    for scan, called in judged:
        answer = answer_of(scan, card)
        for row in np.flatnonzero(scan.valid):
            band = max(i for i, edge in enumerate(RANGE_EDGES) if scan.range[row] >= edge)
            expected[band, answer[row], int(called[row])] += 1
    np.testing.assert_array_equal(answers.table, expected)
    assert answers.points == sum(scan.valid.sum() for scan, _ in judged)


def test_shares_and_agreement_are_those_of_the_points(judged, card) -> None:
    scan, called = judged[0]
    answers = Answers.of(scan, card, called)
    valid, answer = scan.valid, answer_of(scan, card)
    for number in (NOT_RAIN, RAIN, NOT_KNOWN):
        assert answers.shares[number] == pytest.approx((answer[valid] == number).mean())
    assert answers.removed == pytest.approx(called[valid].mean())
    sure = valid & (answer != NOT_KNOWN)
    assert answers.agreement == Counts.of(called[sure], answer[sure] == RAIN)
    assert answers.rain_among_known == pytest.approx((answer[sure] == RAIN).mean())


def test_without_a_student_nothing_is_removed_and_of_no_points_no_share_is_defined(
    scans, card
) -> None:
    assert Answers.of(scans[0], card).removed == 0
    for answers in (Answers.of(scans[0].take([]), card), Answers()):
        assert np.isnan([answers.removed, answers.rain_among_known, *answers.shares]).all()
        assert answers.agreement == Counts()


def test_the_table_has_a_row_for_each_band_and_one_for_all() -> None:
    points = np.zeros((7, 4))
    points[:, 0] = [1, 9.5, 10, 39, 40, 80, np.nan]
    card = DataCard("taught", {0: "a", 1: "b", 2: "c"}, rain=(1,), unknown=(2,))
    answers = Answers.of(Scan.of(points).with_label(np.array([0, 1, 1, 2, 0, 2, 2])), card)
    rows = [line.split() for line in str(answers + answers).splitlines()]
    assert rows[1] == ["0-10", "m", "4", "50.0%", "50.0%", "0.0%"]
    assert rows[-1] == ["all", "12", "33.3%", "33.3%", "33.3%"]
    assert (answers + answers).rain == 4
    assert str(Answers()).splitlines()[-1].split() == ["all", "0", "-", "-", "-"]


YARD = DataCard("yard", {0: "wall", 1: "drop", 2: "car", 9: "nobody knows"}, (1,), (9,))

#               called rain: 1     sure: 1
TRUTH = np.array([1, 1, 1, 1, 0, 0, 0, 2, 2, 9])
CALLED = np.array([1, 1, 0, 1, 0, 0, 1, 1, 0, 1], bool)
SURE = np.array([1, 0, 1, 1, 1, 1, 0, 1, 1, 1], bool)


EVERY = np.ones(len(TRUTH), bool)
FRAME = MemoryFrame(key="0", scan=Scan.of(scene(len(TRUTH))).with_label(TRUTH))


def record_of(card: DataCard, rows: Ints, sure: Bools) -> TruthRecord:
    """A record of one scan that has these rows of the points above."""
    record, scan = TruthRecord(card), FRAME.scan.take(rows)
    answers = (CALLED[rows], EVERY[rows]), (CALLED[rows], sure[rows])
    record.add(MemoryFrame(key="0", scan=scan), scan, *answers)
    return record


def test_all_points_and_sure_ones_are_counted_apart() -> None:
    rows = np.arange(len(TRUTH))
    lines = str(record_of(YARD, rows, SURE)).splitlines()
    # All: 4 drops, 3 found, 2 others called so. Sure: 3 drops, 2 found, 1 other.
    assert lines[1].split() == ["all", "points", "9", "0.600", "0.750", "0.500"]
    assert lines[2].split()[-4:] == ["7", "0.667", "0.667", "0.500"]
    assert [line.split() for line in lines[4:]] == [
        ["wall", "3", "33.33%", "0.00%"],
        ["drop", "(rain)", "4", "75.00%", "66.67%"],
        ["car", "2", "50.00%", "50.00%"],
    ]
    without_doubt = str(record_of(YARD, rows, EVERY)).splitlines()
    assert without_doubt[2].split()[-4:] == lines[1].split()[-4:]


def test_points_at_one_position_count_once_where_the_card_has_it_so() -> None:
    twice = np.tile(np.arange(len(TRUTH)), 2)
    for card, points in ((YARD, "18"), (replace(YARD, deduplicate=True), "9")):
        assert str(record_of(card, twice, SURE)).splitlines()[1].split()[2] == points
