"""Methods side by side on one scan: each point in the colour of what became of it."""

import sys
from collections import Counter

import numpy as np
import pytest
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure

from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.pictures.comparison import (
    MOST_PANELS_IN_A_ROW,
    comparison_figure,
    show_comparison,
)
from derain.pictures.palette import OUTCOMES
from derain.scan import Scan


def coloured(figure: Figure, panel: int, outcome: str) -> int:
    """How many dots of a panel have an outcome's colour."""
    return sum(
        len(drawn.get_offsets())
        for drawn in figure.axes[panel].collections  # each of one colour
        if np.allclose(drawn.get_facecolors(), to_rgba(OUTCOMES[outcome]))
    )


def titles(figure: Figure) -> list[str]:
    return [axes.get_title() for axes in figure.axes if axes.get_title()]


def legend_of(figure: Figure) -> list[str]:
    (legend,) = figure.legends
    return [text.get_text() for text in legend.get_texts()]


def test_each_method_shows_what_it_removes_leaves_and_loses() -> None:
    scan = Scan.of(scene(200))
    chance = np.random.default_rng(0)
    rain, first, second = chance.random((3, 200)) < 0.3
    figure = comparison_figure(scan, {"first": first, "second": second}, rain, "a scan")
    assert titles(figure) == [
        "input: intensity",
        f"truth: {rain.sum()} points of rain",
        f"first: IoU {(first & rain).sum() / (first | rain).sum():.3f}",
        f"second: IoU {(second & rain).sum() / (second | rain).sum():.3f}",
    ]
    for column, called in {2: first, 3: second}.items():
        for panel in (column, column + 4):  # from above, and as seen
            assert coloured(figure, panel, "rain, removed") == (rain & called).sum()
            assert coloured(figure, panel, "rain, left") == (rain & ~called).sum()
            assert coloured(figure, panel, "solid, lost") == (~rain & called).sum()
    assert legend_of(figure) == [*OUTCOMES]


def test_without_truth_what_is_removed_is_shown() -> None:
    scan = Scan.of(scene(200)[:, :3])
    called = np.arange(200) >= 180
    figure = comparison_figure(scan, {"only": called}, None, "a scan")
    assert titles(figure) == ["input", "only: 20 points removed"]
    assert coloured(figure, 1, "rain, removed") == 20
    assert coloured(figure, 1, "solid, kept") == 180
    assert legend_of(figure) == ["kept", "removed"]


def test_a_scan_of_nothing_is_drawn() -> None:
    nothing = np.zeros(0, bool)
    figure = comparison_figure(Scan.of(scene(0)), {"none": nothing}, nothing, "empty")
    figure.draw_without_rendering()
    assert titles(figure)[1:] == ["truth: 0 points of rain", "none: IoU -"]


@pytest.mark.parametrize("methods", [4, 7])  # with the input and the truth, two rows of panels
def test_no_row_of_panels_is_left_with_one_and_no_title_runs_into_another(methods: int) -> None:
    names = ["a method with a name so long that nobody would ever type it", "short"]
    called = {f"{names[n % 2]} {n}": np.zeros(50, bool) for n in range(methods)}
    figure = comparison_figure(Scan.of(scene(50)), called, np.zeros(50, bool), "many")
    figure.draw_without_rendering()
    above = [axes for axes in figure.axes if axes.get_title()]
    assert len(above) == methods + 2
    rows = Counter(round(axes.get_position().y0, 3) for axes in above)
    assert max(rows.values()) <= MOST_PANELS_IN_A_ROW
    assert min(rows.values()) >= max(rows.values()) - 1
    boxes = [axes.title.get_window_extent() for axes in above]
    boxes += [axes.get_window_extent() for axes in figure.axes if axes.axison]
    for number, box in enumerate(boxes[: len(above)]):
        assert box.x0 >= 0
        assert box.x1 <= figure.bbox.x1
        assert not any(box.overlaps(other) for other in boxes[:number] + boxes[number + 1 :])


@pytest.mark.skipif(
    sys.platform != "linux", reason="only Linux says by a variable where a screen is"
)
def test_without_a_screen_a_window_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(InputError, match="there is no screen to open it on"):
        show_comparison(Scan.of(scene(10)), {"none": np.zeros(10, bool)}, None)
