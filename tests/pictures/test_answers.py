"""Pictures of answers draw the shares that were counted."""

import numpy as np
import pytest
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure

from derain.cards.card import DataCard
from derain.evaluation.answers import FINE_EDGES, NOT_KNOWN, RAIN, Answers, AnswersOfScan
from derain.evaluation.hard_cases import scene
from derain.pictures.answers import (
    OF_ANSWERS,
    answers_figure,
    removed_figure,
    teacher_figure,
)
from derain.pictures.palette import OUTCOMES
from derain.scan import Scan

CARD = DataCard("taught", {0: "not rain", 1: "rain", 255: "not known"}, (1,), unknown=(255,))


@pytest.fixture
def scan() -> Scan:
    label = np.resize([0, 0, 0, 0, 1, 255, 0, 1], 4000)
    return Scan.of(scene(4000)).with_label(label)


def heights(figure: Figure, panel: int, answer: int) -> list[float]:
    """Heights of the bars of one answer."""
    bars = figure.axes[panel].patches
    colour = to_rgba(OF_ANSWERS[answer])
    return [bar.get_height() for bar in bars if bar.get_facecolor() == colour]


def test_the_bars_of_a_teacher_are_its_shares_by_scan(scan) -> None:
    counted = [Answers.of(scan, CARD), Answers.of(scan.take(np.arange(0, 4000, 8)), CARD)]
    scans = [AnswersOfScan(False, counted[0]), AnswersOfScan(True, counted[1])]
    figure = teacher_figure(scans, "a teacher")
    assert heights(figure, 0, RAIN) == pytest.approx([0.25, 0.0])
    assert heights(figure, 0, NOT_KNOWN) == pytest.approx([0.125, 0.0])
    assert any(text.get_text() == " held out" for text in figure.axes[0].texts)
    assert not any(text.get_text() for text in teacher_figure(scans[:1], "").axes[0].texts)


def test_the_lines_of_what_is_removed_are_its_shares_by_range(scan) -> None:
    called = np.arange(4000) % 3 == 0
    figure = removed_figure(Answers.of(scan, CARD, called), "removed")
    drawn = {patch.get_label(): patch for patch in figure.axes[0].patches}
    removed = drawn["student: removed"].get_data().values
    rain = drawn["teacher: rain"].get_data().values
    for band, start in enumerate(FINE_EDGES[:10]):
        inside = (scan.range >= start) & (scan.range < start + 5)
        if inside.sum() < 100:
            assert np.isnan(removed[band])
        else:
            assert removed[band] == pytest.approx(called[inside].mean())
            assert rain[band] == pytest.approx((scan.label[inside] == 1).mean())


def test_a_student_beside_its_teacher_is_drawn_point_by_point(scan) -> None:
    called = np.arange(4000) % 3 == 0
    figure = answers_figure(scan, CARD, called, "beside")
    rain, unknown = scan.label == 1, scan.label == 255
    expected = {
        "teacher": (rain.sum(), unknown.sum(), 0),
        "student": (called.sum(), 0, 0),
        "where they differ": (0, (rain & ~called).sum(), (called & ~rain & ~unknown).sum()),
    }
    for axes in figure.axes:
        dots = [
            sum(
                len(drawn.get_offsets())
                for drawn in axes.collections
                if to_rgba(OUTCOMES[outcome]) in map(tuple, drawn.get_facecolors())
            )
            for outcome in ("rain, removed", "rain, left", "solid, lost")
        ]
        assert tuple(dots) == expected[axes.get_title()]


def test_nothing_and_no_points_can_be_drawn() -> None:
    empty = Scan.of(scene(0)).with_label(np.zeros(0, np.int64))
    answers = Answers.of(empty, CARD, np.zeros(0, bool))
    for figure in (
        teacher_figure([AnswersOfScan(False, answers)], ""),
        removed_figure(answers, ""),
        answers_figure(empty, CARD, np.zeros(0, bool), ""),
    ):
        figure.canvas.draw()
