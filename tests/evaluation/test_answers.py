"""Answers of teacher and student are counted point by point."""

import numpy as np
import pytest

from derain.cards.card import DataCard
from derain.evaluation.answers import (
    FINE_EDGES,
    NOT_KNOWN,
    NOT_RAIN,
    RAIN,
    Answers,
    answer_of,
    total,
)
from derain.evaluation.counts import Counts
from derain.scan import Scan


@pytest.fixture
def asked(scans: list[Scan]) -> list[tuple[Scan, np.ndarray]]:
    """Labelled scans, with rows that cannot be judged, and what a student calls rain in them."""
    rng = np.random.default_rng(0)
    for scan in scans:
        scan.xyz[::50] = np.nan
        scan.xyz[7] = (300, 0, 0)
    return [(scan, rng.random(len(scan)) < 0.3) for scan in scans]


def test_every_point_that_can_be_judged_is_counted_once(
    asked: list[tuple[Scan, np.ndarray]], card: DataCard
) -> None:
    answers = total([Answers.of(scan, card, called) for scan, called in asked])
    expected = np.zeros_like(answers.table)
    for scan, called in asked:
        answer = answer_of(scan, card)
        for row in np.flatnonzero(scan.valid):
            band = max(i for i, edge in enumerate(FINE_EDGES) if scan.range[row] >= edge)
            expected[band, answer[row], int(called[row])] += 1
    np.testing.assert_array_equal(answers.table, expected)
    assert answers.points == sum(scan.valid.sum() for scan, _ in asked)


def test_shares_and_agreement_are_those_of_the_points(
    asked: list[tuple[Scan, np.ndarray]], card: DataCard
) -> None:
    scan, called = asked[0]
    answers = Answers.of(scan, card, called)
    valid, answer = scan.valid, answer_of(scan, card)
    for number in (NOT_RAIN, RAIN, NOT_KNOWN):
        assert answers.shares[number] == pytest.approx((answer[valid] == number).mean())
    assert answers.removed == pytest.approx(called[valid].mean())
    sure = valid & (answer != NOT_KNOWN)
    assert answers.agreement == Counts.of(called[sure], answer[sure] == RAIN)
    assert answers.rain_among_known == pytest.approx((answer[sure] == RAIN).mean())


def test_without_a_student_nothing_is_removed_and_of_no_points_no_share_is_defined(
    scans: list[Scan], card: DataCard
) -> None:
    assert Answers.of(scans[0], card).removed == 0
    for answers in (Answers.of(scans[0].take([]), card), total([])):
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
    assert str(Answers.none()).splitlines()[-1].split() == ["all", "0", "-", "-", "-"]
