"""Pictures show every judged point once, in the colour of what became of it."""

import sys
import warnings
from collections import Counter

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.image import imread

from derain.errors import InputError
from derain.evaluation.hard_cases import hard_cases, scene
from derain.pictures.palette import OUTCOMES, PROBABILITY, rgb, shades
from derain.pictures.scan_pictures import (
    MOST_PANELS_IN_A_ROW,
    before_after_figure,
    comparison_figure,
    save,
    show_comparison,
)
from derain.pictures.selection import SensorLook
from derain.scan import Scan
from derain.sources.frame import MemoryFrame


def dots(axes: Axes) -> dict[str, int]:
    """Number of dots in a panel by their outcome; of none in other colours."""
    found = dict.fromkeys(OUTCOMES, 0)
    for drawn in axes.collections:  # each of one colour
        colour = drawn.get_facecolors()[0]
        outcome = [name for name, of in OUTCOMES.items() if np.allclose(colour, to_rgba(of))]
        found[outcome[0]] += len(drawn.get_offsets())
    return found


def places(axes: Axes) -> np.ndarray:
    """Places of all dots in a panel, (N, 2)."""
    return np.concatenate(
        [np.zeros((0, 2)), *(np.asarray(d.get_offsets()) for d in axes.collections)]
    )


def panels(figure: Figure) -> dict[str, list[Axes]]:
    """The two panels, from above and as seen, of every column, by its title."""
    titled = [axes for axes in figure.axes if axes.get_title()]
    columns = len(titled)
    return {axes.get_title(): figure.axes[n::columns][:2] for n, axes in enumerate(titled)}


def expected(predicted: np.ndarray, rain: np.ndarray, seen: np.ndarray) -> dict[str, int]:
    """Number of seen points by their outcome."""
    outcomes = (~rain & ~predicted, rain & predicted, rain & ~predicted, ~rain & predicted)
    return dict(zip(OUTCOMES, (int((each & seen).sum()) for each in outcomes), strict=True))


@pytest.fixture
def judged() -> tuple[Scan, np.ndarray, np.ndarray]:
    """A scan with four rows that cannot be judged, what was called rain in it, and what is."""
    points = scene(200)
    points[[3, 50, 150, 199]] = np.nan
    scan = Scan.of(points)
    rng = np.random.default_rng(0)
    predicted, rain = rng.random((2, 200)) < [[0.3], [0.4]]
    return scan, predicted & scan.valid, rain


def test_each_method_shows_what_it_removes_leaves_and_loses(judged) -> None:
    scan, first, rain = judged
    second = ~first & scan.valid
    figure = comparison_figure(scan, {"first": first, "second": second}, rain, "a scan")
    iou = [(called & rain).sum() / (called | rain).sum() for called in (first, second)]
    shown = panels(figure)
    assert list(shown) == [
        "input: intensity",
        f"truth: {rain.sum()} points of rain",
        f"first: IoU {iou[0]:.3f}",
        f"second: IoU {iou[1]:.3f}",
    ]
    for called, pair in zip((rain, first, second), [*shown.values()][1:], strict=True):
        assert [dots(axes) for axes in pair] == [expected(called, rain, scan.valid)] * 2
    assert [len(places(axes)) for axes in shown["input: intensity"]] == [196] * 2
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [*OUTCOMES]


def test_without_truth_what_is_removed_is_shown() -> None:
    called = np.arange(200) >= 180
    figure = comparison_figure(Scan.of(scene(200)[:, :3]), {"only": called}, None, "a scan")
    shown = panels(figure)
    assert list(shown) == ["input", "only: 20 points removed"]
    seen = np.ones(200, bool)
    assert dots(shown["only: 20 points removed"][0]) == expected(called, called, seen)
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["kept", "removed"]
    nothing = np.zeros(0, bool)
    figure = comparison_figure(Scan.of(scene(0)), {"none": nothing}, nothing, "empty")
    assert list(panels(figure))[1:] == ["truth: 0 points of rain", "none: IoU -"]


@pytest.mark.parametrize("filled", [np.nan, np.inf, 7])
def test_intensities_that_were_not_measured_are_not_shown(filled) -> None:
    points = scene(200)
    points[:, 3] = filled
    scans = [Scan.of(points), Scan.of(points[:, :3])]
    figures = [comparison_figure(scan, {"none": np.zeros(200, bool)}, None, "") for scan in scans]
    inputs = [panels(figure)["input"][0].collections for figure in figures]
    np.testing.assert_array_equal(*([each.get_facecolors() for each in drawn] for drawn in inputs))
    looks = [SensorLook.of([MemoryFrame(key="0", scan=scan)]) for scan in scans]
    assert looks[0].brightest == looks[1].brightest
    np.testing.assert_array_equal(*(looks[1].colours(scan) for scan in scans))


def test_no_row_of_panels_is_left_with_one_and_no_title_runs_into_another() -> None:
    names = ["a method with a name so long that nobody would ever type it", "short"]
    called = {f"{names[n % 2]} {n}": np.zeros(50, bool) for n in range(7)}
    figure = comparison_figure(Scan.of(scene(50)), called, np.zeros(50, bool), "many")
    figure.draw_without_rendering()
    above = [axes for axes in figure.axes if axes.get_title()]
    assert len(above) == 9  # with the input and the truth
    rows = Counter(round(axes.get_position().y0, 3) for axes in above)
    assert max(rows.values()) <= MOST_PANELS_IN_A_ROW
    assert min(rows.values()) >= max(rows.values()) - 1
    boxes = [axes.title.get_window_extent() for axes in above]
    boxes += [axes.get_window_extent() for axes in figure.axes if axes.axison]
    for number, box in enumerate(boxes[: len(above)]):
        assert figure.bbox.x0 <= box.x0 <= box.x1 <= figure.bbox.x1
        assert not any(box.overlaps(other) for other in boxes[:number] + boxes[number + 1 :])


def test_rare_outcomes_are_drawn_larger_and_on_top() -> None:
    scan = Scan.of(scene(20_000))
    predicted, rain = np.arange(20_000) >= 19_970, np.arange(20_000) >= 19_000
    figure = comparison_figure(scan, {"one": predicted}, rain, "a scan")
    drawn = [*panels(figure).values()][-1][0].collections  # from the lowest to the topmost
    assert [len(each.get_offsets()) for each in drawn] == [19_000, 970, 30]
    kept, left, removed = (each.get_sizes()[0] for each in drawn)
    assert removed > 3 * left >= 3 * kept
    assert removed > 10  # points of print squared: 40 pixels and more


def test_the_two_views_are_in_the_sensor_frame() -> None:
    # One point ahead and 1 m to the left, one ahead and 1 m to the right and 1 m up.
    scan = Scan.of(np.array([[2, 1, 0, 9], [1, -1, 1, 9]], np.float32))
    figure = before_after_figure(scan, np.array([False, False]), "two points")
    above, ahead = (sorted(places(axes).tolist()) for axes in [*panels(figure).values()][-1])
    np.testing.assert_allclose(above, [[-1, 2], [1, 1]])
    left, up = np.degrees(np.arctan2(1, 2)), np.degrees(np.arctan2(1, np.sqrt(2)))
    np.testing.assert_allclose(ahead, [[-left, 0], [45, up]], atol=1e-12)


HARD_TO_DRAW = ("empty", "nothing valid", "near and far together", "on a line", "intensity 0")


@pytest.mark.parametrize("name", HARD_TO_DRAW)
def test_before_and_after_differ_by_what_was_found_without_a_warning(name) -> None:
    scan = dict(hard_cases(200))[name]
    found = scan.valid & (np.arange(len(scan)) % 2 == 0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figure = before_after_figure(scan, found, name)
        figure.draw_without_rendering()
    seen, left = int(scan.valid.sum()), int((scan.valid & ~found).sum())
    (title, before), (after_title, after) = panels(figure).items()
    assert title.startswith(f"before: {seen:,} points")
    assert after_title == f"after: {left:,} points"
    nothing = np.zeros(len(scan), bool)
    kept = expected(nothing, nothing, scan.valid & ~found)
    assert [dots(axes) for axes in before] == [expected(found, found, scan.valid)] * 2
    assert [dots(axes) for axes in after] == [kept] * 2
    for axes in figure.axes:
        # Something of what is there is in sight.
        low, high = np.transpose([axes.get_xlim(), axes.get_ylim()])
        at = places(axes)
        assert ((low <= at) & (at <= high)).all(axis=1).any() == bool(len(at))


def test_a_picture_is_saved_as_png_and_nothing_stays_where_it_cannot_be(tmp_path, judged) -> None:
    scan, predicted, _ = judged
    path = tmp_path / "new" / "picture.png"
    save(before_after_figure(scan, predicted, "a scan"), path)
    assert imread(path).shape == (990, 1540, 4)
    assert [file.name for file in path.parent.iterdir()] == ["picture.png"]
    with pytest.raises(InputError, match=r"picture\.png: cannot be written"):
        save(Figure(), path / "picture.png")
    assert [file.name for file in tmp_path.iterdir()] == ["new"]


@pytest.mark.skipif(sys.platform != "linux", reason="a variable names the screen")
def test_without_a_screen_a_window_is_refused(monkeypatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(InputError, match="there is no screen to open it on"):
        show_comparison(Scan.of(scene(10)), {"none": np.zeros(10, bool)}, None)


def test_shades_lie_between_their_colours_and_the_more_probable_is_brighter() -> None:
    share = np.array([-1.0, 0.0, 0.25, 0.5, 1.0, 2.0])
    first, middle, last = (np.array(rgb(colour)) for colour in PROBABILITY)
    between = np.round((first + middle) / 2)
    expected = np.array([first, first, between, middle, last, last])
    np.testing.assert_array_equal(shades(PROBABILITY, share), expected)
    # Source: luma of ITU-R BT.601.
    luma = shades(PROBABILITY, np.linspace(0, 1, 101)) @ np.array([0.299, 0.587, 0.114])
    assert (np.diff(luma) > 0).all()
