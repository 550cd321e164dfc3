"""The report holds the counts, and doubts where they give reason to."""

from pathlib import Path

import numpy as np
import pytest

from derain.evaluation.answers import NOT_KNOWN, NOT_RAIN, RAIN, Answers
from derain.evaluation.counts import RANGE_EDGES
from derain.workflows.learn_report import ALWAYS, LearnResults, as_markdown, doubts


def answers(
    not_rain: int, rain: int, unknown: int = 0, removed: tuple[int, int, int] = (0, 0, 0)
) -> Answers:
    """Points of 10 to 20 m; of each answer of the teacher, so many are called rain."""
    table = np.zeros((len(RANGE_EDGES), 3, 2), np.int64)
    for answer, points, called in zip(
        (NOT_RAIN, RAIN, NOT_KNOWN), (not_rain, rain, unknown), removed, strict=True
    ):
        table[RANGE_EDGES.index(10), answer] = points - called, called
    return Answers(table)


def results_of(
    taught: Answers, student: Answers | None = None, scans: int = 16, **facts
) -> LearnResults:
    """Results of some scans, all alike, of which four are held out."""
    return LearnResults(
        "a drive",
        "persistence",
        "outdet",
        Path("model.onnx"),
        Path("work/report.md"),
        sum([taught] * scans, Answers()),
        scans - 4,
        4,
        student or Answers(),
        **facts,
    )


GOOD = answers(not_rain=90_000, rain=9_000, unknown=1_000, removed=(300, 8_500, 500))

# Persistence's answers, and beside them those of a teacher that finds a third of its rain.
BLIND = answers(not_rain=90_000, rain=9_000, unknown=1_000, removed=(0, 3_000, 0))


def test_good_results_raise_no_doubt_but_that_of_units() -> None:
    (doubt,) = doubts(results_of(GOOD, GOOD))
    assert "intensity" in doubt
    assert not list(doubts(results_of(GOOD, GOOD, sees_intensity=False, persistence=GOOD)))


@pytest.mark.parametrize(
    ("results", "names"),
    [
        (results_of(answers(100_000, 50)), "Hardly any rain was found (0.05%"),
        (results_of(answers(100_000, 500)), "Little rain was found (0.50%"),
        (results_of(GOOD, scans=8), "4 scans to learn from are few"),
        (results_of(answers(5_000, 1_000, 4_000)), "sure of 60% of the points"),
        (results_of(GOOD, persistence=BLIND), "At 10-20 m persistence is sure that 9.0%"),
        (results_of(GOOD, persistence=answers(10, 0, 90)), "sure of only 10%"),
        (results_of(GOOD, stood=True), "The sensor was at rest"),
        (results_of(GOOD, GOOD, warnings=["far apart", "empty"]), "unusual: far apart"),
        (results_of(GOOD, GOOD, warnings=["far apart", "empty"]), "unusual: empty"),
        (results_of(GOOD, answers(90_000, 900, removed=(0, 900, 0))), "found 900 points of rain"),
        (results_of(GOOD, answers(90_000, 9_000, removed=(0, 2_250, 0))), "IoU of 0.25"),
        (
            results_of(GOOD, answers(90_000, 9_000, 1_000, removed=(9_000, 9_000, 0))),
            "At 10-20 m it removes 18.0% of the points, of which the teacher labels 9.0% rain and "
            "1.0% not known",
        ),
    ],
    ids=lambda case: case[:20] if isinstance(case, str) else "",
)
def test_what_gives_reason_to_doubt_is_reported(results, names) -> None:
    assert any(names in doubt for doubt in doubts(results))
    assert names in as_markdown(results)


def test_the_tables_hold_the_counts() -> None:
    text = as_markdown(results_of(GOOD, GOOD))
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in text.splitlines()]
    assert ["10-20 m", "1,600,000", "90.0%", "9.0%", "1.0%"] in rows
    precision, recall, iou = 8_500 / 8_800, 8_500 / 9_000, 8_500 / 9_300
    scores = [f"{score:.3f}" for score in (precision, recall, iou)]
    assert ["10-20 m", "100,000", "9.3%", *scores] in rows
    assert not any(row[:1] == ["0-10 m"] for row in rows)  # no point is there
    assert ALWAYS in text
    assert f"to an IoU of {iou:.3f}, and removes 9.3%" in str(results_of(GOOD, GOOD))
    # A band without rain has no scores.
    text = as_markdown(results_of(GOOD, answers(500, 0)))
    (row,) = [line for line in text.splitlines() if line.startswith("| 10-20 m |    500 |")]
    assert [cell.strip() for cell in row.split("|")[3:-1]] == ["0.0%", "-", "-", "-"]
    text = as_markdown(results_of(GOOD, persistence=BLIND))
    (row,) = [line for line in text.splitlines() if line.startswith("| 10-20 m | 100,000 |")]
    assert [cell.strip() for cell in row.split("|")[3:-1]] == ["9.0%", "1.0%", "3.0%"]
    # Before the training, the report is of the teacher alone.
    assert "## The student" not in as_markdown(results_of(GOOD))


def test_the_pictures_of_held_out_scans_are_in_the_report() -> None:
    pictures = {Path("work/held_out_1.png"): "9 before and after"}
    text = as_markdown(results_of(GOOD, GOOD, pictures=pictures))
    assert "![9 before and after](held_out_1.png)" in text
