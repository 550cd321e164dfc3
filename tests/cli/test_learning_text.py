"""The report says what the counts say, and warns where they give reason to."""

from pathlib import Path

import numpy as np
import pytest

from derain.cli.learning_text import ALWAYS, Learnt, as_markdown, doubts, summary
from derain.evaluation.answers import FINE_EDGES, NOT_KNOWN, NOT_RAIN, RAIN, Answers, AnswersOfScan


def answers(
    not_rain: int, rain: int, unknown: int = 0, removed: tuple[int, int, int] = (0, 0, 0)
) -> Answers:
    """Points of 10 to 15 m; of each answer of the teacher, so many are called rain."""
    table = np.zeros((len(FINE_EDGES), 3, 2), np.int64)
    for answer, points, called in zip(
        (NOT_RAIN, RAIN, NOT_KNOWN), (not_rain, rain, unknown), removed, strict=True
    ):
        table[FINE_EDGES.index(10), answer] = points - called, called
    return Answers(table)


def lesson(taught: Answers, asked: Answers | None = None, scans: int = 16, **facts) -> Learnt:
    """Of so many scans the last four are held out, all alike."""
    return Learnt(
        "a drive",
        "persistence",
        "outdet",
        [AnswersOfScan(f"{n}", n >= scans - 4, taught) for n in range(scans)],
        [] if asked is None else [AnswersOfScan("last", True, asked)],
        **facts,
    )


GOOD = answers(not_rain=90_000, rain=9_000, unknown=1_000, removed=(300, 8_500, 500))


def test_a_good_lesson_raises_no_doubt_but_that_of_units() -> None:
    learnt = lesson(GOOD, GOOD)
    (doubt,) = doubts(learnt)
    assert "sees intensity in the unit of this recording" in doubt
    assert not list(doubts(lesson(GOOD, GOOD, sees_intensity=False)))


@pytest.mark.parametrize(
    ("learnt", "says"),
    [
        (lesson(answers(100_000, 50)), "Hardly any rain was found (0.05%"),
        (lesson(answers(100_000, 500)), "Little rain was found (0.50%"),
        (lesson(GOOD, scans=8), "4 scans to learn from are few"),
        (lesson(answers(5_000, 1_000, 4_000)), "sure of 60% of the points only"),
        (lesson(GOOD, stood=True), "The sensor stood"),
        (lesson(GOOD, GOOD, warned=["a: far apart", "b"]), "a: far apart (and 1 more in log.txt)"),
        (lesson(GOOD, answers(90_000, 900, removed=(0, 900, 0))), "found 900 points of rain"),
        (lesson(GOOD, answers(90_000, 9_000, removed=(0, 2_250, 0))), "to an IoU of 0.25 only"),
        (
            lesson(GOOD, answers(90_000, 9_000, 1_000, removed=(9_000, 9_000, 0))),
            "At 10-20 m it removes 18.0% of the points, where the teacher saw 9.0% of rain and did "
            "not know of 1.0%",
        ),
    ],
    ids=lambda case: case[:20] if isinstance(case, str) else "",
)
def test_what_gives_reason_to_doubt_is_told(learnt: Learnt, says: str) -> None:
    assert any(says in doubt for doubt in doubts(learnt))
    assert says in as_markdown(learnt)


def test_the_tables_hold_the_counts() -> None:
    text = as_markdown(lesson(GOOD, GOOD))
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in text.splitlines()]
    assert ["10-20 m", "1,600,000", "90.0%", "9.0%", "1.0%"] in rows
    precision, recall, iou = 8_500 / 8_800, 8_500 / 9_000, 8_500 / 9_300
    scores = [f"{score:.3f}" for score in (precision, recall, iou)]
    assert ["10-20 m", "100,000", "9.3%", *scores] in rows
    assert not any(row[:1] == ["0-10 m"] for row in rows)  # no point is there
    assert ALWAYS in text
    assert f"to an IoU of {iou:.3f}, and removes 9.3%" in summary(lesson(GOOD, GOOD))


def test_a_band_without_rain_has_no_scores() -> None:
    text = as_markdown(lesson(GOOD, answers(500, 0)))
    (row,) = [line for line in text.splitlines() if line.startswith("| 10-20 m |    500 |")]
    assert [cell.strip() for cell in row.split("|")[3:-1]] == ["0.0%", "-", "-", "-"]


def test_before_the_student_has_learnt_nothing_is_said_of_it() -> None:
    text = as_markdown(lesson(GOOD, pictures={Path("work/teacher.png"): "shares"}))
    assert "![shares](teacher.png)" in text
    assert "## The student" not in text
    assert "agrees with it" not in text
