"""Pictures show every judged point once, in the colour of what became of it."""

import warnings
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.image import imread

from derain.errors import InputError
from derain.evaluation.hard_cases import hard_cases, scene
from derain.pictures.palette import OUTCOMES
from derain.pictures.scan_pictures import before_after_figure, judgement_figure, save
from derain.scan import Scan


def dots_in(axes: Axes) -> np.ndarray:
    """Places and colours, (N, 2 + 4), of the dots in a panel."""
    parts = [np.zeros((0, 6))]
    for drawn in axes.collections:  # each of one colour
        places = np.asarray(drawn.get_offsets())
        colours = np.repeat(drawn.get_facecolors(), len(places), axis=0)
        parts.append(np.column_stack([places, colours]))
    return np.concatenate(parts)


def dots_of(figure: Figure, panel: int, outcome: str) -> int:
    colours = dots_in(figure.axes[panel])[:, 2:]
    return int(np.isclose(colours, to_rgba(OUTCOMES[outcome])).all(axis=1).sum())


@pytest.fixture
def judged() -> tuple[Scan, np.ndarray, np.ndarray]:
    """A scan with four rows that cannot be judged, what was called rain in it, and what is."""
    points = scene(200)
    points[[3, 50, 150, 199]] = np.nan
    scan = Scan.of(points)
    rng = np.random.default_rng(0)
    predicted, rain = rng.random((2, 200)) < [[0.3], [0.4]]
    return scan, predicted & scan.valid, rain


def panels(figure: Figure) -> dict[str, list[int]]:
    """Numbers of the two panels, from above and ahead, of every column, by its title."""
    titles = [axes.get_title() for axes in figure.axes]
    columns = len(titles) // 2
    return {title: [column, column + columns] for column, title in enumerate(titles[:columns])}


def test_the_panels_of_a_judgement_count_what_became_of_the_points(
    judged: tuple[Scan, np.ndarray, np.ndarray],
) -> None:
    scan, predicted, rain = judged
    figure = judgement_figure(scan, predicted, rain, "a scan")
    shown = panels(figure)
    assert list(shown) == ["input: intensity", "truth", "prediction", "error"]
    seen = scan.valid
    expected = {
        "truth": {"solid, kept": ~rain, "rain, removed": rain},
        "prediction": {"solid, kept": ~predicted, "rain, removed": predicted},
        "error": {
            "solid, kept": ~rain & ~predicted,
            "rain, removed": rain & predicted,
            "rain, left": rain & ~predicted,
            "solid, lost": ~rain & predicted,
        },
    }
    for title, outcomes in expected.items():
        for panel in shown[title]:
            found = {outcome: dots_of(figure, panel, outcome) for outcome in OUTCOMES}
            assert found == {o: int((outcomes.get(o, ~seen) & seen).sum()) for o in OUTCOMES}
    for panel in range(len(figure.axes)):
        assert len(dots_in(figure.axes[panel])) == seen.sum() == 196


def test_rare_outcomes_are_drawn_larger_and_on_top() -> None:
    scan = Scan.of(scene(100_000))
    predicted, rain = np.arange(100_000) >= 99_970, np.arange(100_000) >= 99_000
    figure = judgement_figure(scan, predicted, rain, "a scan")
    above, _ = panels(figure)["error"]
    drawn = figure.axes[above].collections  # from the lowest to the topmost
    assert [len(each.get_offsets()) for each in drawn] == [99_000, 970, 30]
    kept, left, removed = (each.get_sizes()[0] for each in drawn)
    assert removed > 4 * left > 4 * kept
    assert removed > 10  # points of print squared: 40 pixels and more


def test_the_two_views_are_in_the_sensor_frame() -> None:
    # One point ahead and 1 m to the left, one ahead and 1 m to the right and 1 m up.
    scan = Scan.of(np.array([[2, 1, 0, 9], [1, -1, 1, 9]], np.float32))
    figure = before_after_figure(scan, np.array([False, False]), "two points")
    above, ahead = list(panels(figure).values())[-1]
    np.testing.assert_allclose(
        sorted(dots_in(figure.axes[above])[:, :2].tolist()), [[-1, 2], [1, 1]]
    )
    np.testing.assert_allclose(
        sorted(dots_in(figure.axes[ahead])[:, :2].tolist()),
        [
            [-np.degrees(np.arctan2(1, 2)), 0],
            [45, np.degrees(np.arctan2(1, np.sqrt(2)))],
        ],
        atol=1e-12,
    )


def test_before_and_after_differ_by_what_was_found(
    judged: tuple[Scan, np.ndarray, np.ndarray],
) -> None:
    scan, predicted, _ = judged
    figure = before_after_figure(scan, predicted, "a scan")
    removed = int(predicted.sum())
    titles = list(panels(figure))
    assert titles[0].startswith("before: 196 points")
    assert titles[-1] == f"after: {196 - removed} points"
    for before, after in zip(*(panels(figure)[titles[end]] for end in (0, -1)), strict=True):
        assert dots_of(figure, before, "rain, removed") == removed
        assert len(dots_in(figure.axes[before])) == 196
        assert (
            dots_of(figure, after, "solid, kept")
            == len(dots_in(figure.axes[after]))
            == 196 - removed
        )


HARD_TO_DRAW = ("empty", "nothing valid", "near and far together", "on a line", "intensity 0")


@pytest.mark.parametrize(
    ("name", "scan"), [case for case in hard_cases(200) if case[0] in HARD_TO_DRAW]
)
def test_a_hard_case_is_drawn_without_a_warning(name: str, scan: Scan) -> None:
    found = scan.valid & (np.arange(len(scan)) % 2 == 0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figure = before_after_figure(scan, found, name)
        figure.draw_without_rendering()
    judged, left = int(scan.valid.sum()), int((scan.valid & ~found).sum())
    for axes, drawn in zip(figure.axes, [judged, left, judged, left], strict=True):
        places = dots_in(axes)[:, :2]
        assert len(places) == drawn
        # Something of what is there is in sight.
        (low, high) = np.transpose([axes.get_xlim(), axes.get_ylim()])
        assert ((low <= places) & (places <= high)).all(axis=1).any() == bool(drawn)


def test_a_picture_is_saved_as_png(
    tmp_path: Path, judged: tuple[Scan, np.ndarray, np.ndarray]
) -> None:
    scan, predicted, _ = judged
    path = tmp_path / "new" / "picture.png"
    save(before_after_figure(scan, predicted, "a scan"), path)
    assert imread(path).shape == (990, 1540, 4)
    assert [file.name for file in path.parent.iterdir()] == ["picture.png"]


def test_a_picture_of_no_known_format_or_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    for name in ("picture", "picture.xyz"):
        with pytest.raises(InputError, match=r"no format of pictures\. Name it"):
            save(Figure(), tmp_path / name)
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match=r"picture\.png: cannot be written"):
        save(Figure(), tmp_path / "file" / "picture.png")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
