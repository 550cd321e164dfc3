"""Pictures of errors: what stands in the table, and where the curve is marked."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from derain.evaluation.counts import ClassCounts
from derain.evaluation.operating_points import ThresholdCounts
from derain.pictures.error_pictures import errors_figure, operating_points_figure

BANDS = ["0-10 m", "10+ m"]


def table_of(figure: Figure) -> tuple[list[str], list[str]]:
    """The rows' names and what stands in the cells, row by row."""
    (axes,) = figure.axes
    names = [label.get_text() for label in axes.get_yticklabels()]
    return names, [text.get_text() for text in axes.texts]


def chosen_point(figure: Figure) -> Line2D:
    """The mark of the chosen threshold on the curve."""
    (chosen,) = (line for line in figure.axes[0].lines if str(line.get_label())[:6] == "chosen")
    return chosen


def test_the_table_has_shares_and_points_with_rain_first() -> None:
    counts = {
        "road": [ClassCounts(100, 1, rain=False), ClassCounts(0, 0, rain=False)],
        "car": [ClassCounts(50, 15, rain=False), ClassCounts(50, 0, rain=False)],
        "nobody": [ClassCounts(0, 0, rain=False)] * 2,
        "drops": [ClassCounts(40, 30, rain=True), ClassCounts(10, 10, rain=True)],
    }
    names, cells = table_of(errors_figure(counts, BANDS, "title"))
    assert names == ["drops (rain)", "car", "road"]
    assert cells == [
        *("25.00%\n10 of 40", "0.00%\n0 of 10", "20.00%\n10 of 50"),
        *("30.00%\n15 of 50", "0.00%\n0 of 50", "15.00%\n15 of 100"),
        *("1.00%\n1 of 100", "-", "1.00%\n1 of 100"),
    ]


def test_the_curve_is_marked_where_the_threshold_is() -> None:
    rng = np.random.default_rng(0)
    rain = rng.random(1000) < 0.3
    probability = np.clip(rng.normal(np.where(rain, 0.7, 0.3), 0.2), 0, 1).astype(np.float32)
    metric = ThresholdCounts([0.123])
    metric.update(probability, rain)
    chosen = chosen_point(operating_points_figure(metric.points(), 0.123, "title"))
    called = probability > 0.123
    assert chosen.get_xdata() == pytest.approx([(called & rain).sum() / rain.sum()])
    assert chosen.get_ydata() == pytest.approx([(called & rain).sum() / called.sum()])
    assert "threshold 0.123" in str(chosen.get_label())

    # A threshold that nothing exceeds has no precision.
    metric = ThresholdCounts()
    metric.update(np.full(10, 0.5, np.float32), np.arange(10) < 5)
    chosen = chosen_point(operating_points_figure(metric.points(), 1.0, "title"))
    assert "precision -, recall 0.000, IoU 0.000" in str(chosen.get_label())
