"""The picture of error against time: its front, and labels that can all be read."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from derain.pictures.speed_error import (
    LEAST_ERROR,
    Standing,
    pareto_front,
    readable_size,
    speed_error_figure,
)
from derain.scan import Floats

values = st.sampled_from([0.0, 0.1, 0.2, 0.5, 1.0])
standings = st.lists(
    st.builds(Standing, st.just("x"), values, values.map(lambda v: v + 1), st.just("filter")),
    min_size=1,
    max_size=8,
)


@given(standings)
def test_the_pareto_front_is_what_no_other_method_surpasses(methods) -> None:
    def surpasses(a: Standing, b: Standing) -> bool:
        no_worse = a.error <= b.error and a.milliseconds <= b.milliseconds
        return no_worse and (a.error, a.milliseconds) != (b.error, b.milliseconds)

    places = {
        (m.milliseconds, m.error) for m in methods if not any(surpasses(n, m) for n in methods)
    }
    front = [(m.milliseconds, m.error) for m in pareto_front(methods)]
    assert front == sorted(places)


def crowd(seed: int) -> list[Standing]:
    """Sixteen methods, half of them close together, and some of them files."""
    generator = np.random.default_rng(seed)
    error = np.concatenate([generator.uniform(0.02, 1, 8), generator.normal(0.2, 0.01, 8)])
    milliseconds = np.concatenate([generator.uniform(5, 900, 8), generator.normal(120, 8, 8)])
    kinds = itertools.cycle([("network", 67_535), ("filter", None), ("baseline", None)])
    places = zip(error, milliseconds, kinds, strict=False)
    return [
        Standing(f"method number {number}", *place, *kind)
        for number, (*place, kind) in enumerate(places)
    ]


def drawn(methods: list[Standing]) -> tuple[Figure, Floats, list[Bbox]]:
    """The picture, the places of its markers, pixels, and the extents of its labels' letters."""
    figure = speed_error_figure(methods, "methods")
    figure.draw_without_rendering()
    (axes,) = figure.axes
    places = axes.transData.transform([(m.milliseconds, m.error) for m in methods])
    # Of the letters alone, without the line that leads to them.
    return figure, places, [Text.get_window_extent(text) for text in axes.texts]


@pytest.mark.parametrize("seed", range(2))
def test_labels_cover_neither_each_other_nor_a_marker(seed) -> None:
    methods = crowd(seed)
    figure, places, boxes = drawn(methods)
    assert [text.get_text() for text in figure.axes[0].texts] == [each.label for each in methods]
    assert not any(one.overlaps(other) for one, other in itertools.combinations(boxes, 2))
    assert not any(box.contains(*place) for box in boxes for place in places)
    for number, (text, box) in enumerate(zip(figure.axes[0].texts, boxes, strict=True)):
        beyond = np.maximum(np.maximum(box.min - places, places - box.max), 0)
        # A label without a line is nearer to its own marker than to any other.
        assert text.arrow_patch or np.argmin(np.hypot(*beyond.T)) == number


def test_sizes_of_files_are_written_short_beside_the_titles() -> None:
    texts = {0: "1 kB", 1_499: "1 kB", 999_499: "999 kB", 999_500: "1.0 MB", 6_849_378: "6.8 MB"}
    assert {size: readable_size(size) for size in texts} == texts
    perfect = Standing("perfect", 0.0, 3.0, "network")
    assert perfect.place == (3.0, LEAST_ERROR)
    assert Standing("outdet", 0.1, 60.0, "network", 67_535).label == "outdet · 68 kB"
