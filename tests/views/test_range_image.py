"""The range view against brute force, with every trouble, and on real scans."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from derain.evaluation.hard_cases import hard_cases
from derain.files import read_scan
from derain.files.labels import label_beside, read_labels
from derain.scan import Bools, Ints, Scan, class_ids
from derain.views.back_projection import BACK_PROJECTIONS, REACH, ProjectedPoints
from derain.views.candidates import Bound, Candidates
from derain.views.grid_fit import fit_grid
from derain.views.range_image import RangeView
from derain.views.spherical_grid import SphericalGrid, grid_of
from derain.views.view import IGNORED

FULL = SphericalGrid.even(6, 12, (-40, 40))
FRONT = SphericalGrid.even(6, 12, (-40, 40), (-60, 60))
HARD_CASES = dict(hard_cases())

# Few positions: many duplicates, many equal ranges, points at the origin and on borders.
clouds = hnp.arrays(
    np.float32,
    st.tuples(st.integers(0, 80), st.just(4)),
    elements=st.sampled_from([-4.0, -2.0, -1.0, -0.0, 0.0, 1.0, 3.0, float("nan")]),
)


def shown_by_hand(scan: Scan, pixel: Ints, size: int) -> list[int]:
    """Row of the nearest return of each pixel, the first of equally near ones."""
    winner = [-1] * size
    for row in np.lexsort((np.arange(len(scan)), scan.range)):
        if pixel[row] >= 0 and winner[pixel[row]] < 0:
            winner[pixel[row]] = int(row)
    return winner


@pytest.mark.parametrize("grid", [FULL, FRONT], ids=["full circle", "front"])
@given(points=clouds)
def test_every_pixel_shows_the_nearest_of_its_points(grid, points) -> None:
    scan = Scan.of(points)
    image = RangeView(grid)(scan)
    expected = np.full(len(scan), -1)
    expected[scan.valid] = grid.pixel(scan.xyz[scan.valid])
    np.testing.assert_array_equal(image.pixel, expected)
    winner = shown_by_hand(scan, image.pixel, image.size)
    assert image.winner.tolist() == winner
    for number, row in enumerate(winner):
        content = image.image.reshape(len(RangeView.channels), -1)[:, number]
        held = np.zeros(5) if row < 0 else np.nan_to_num([scan.range[row], *points[row]])
        np.testing.assert_array_equal(content, np.float32(held))
    np.testing.assert_array_equal(image.valid.ravel(), np.array(winner) >= 0)
    nearest = [np.inf if row < 0 else scan.range[row] for row in winner]
    np.testing.assert_array_equal(image.nearest.ravel(), np.float32(nearest))


@given(points=clouds, random=st.randoms(use_true_random=False))
def test_the_order_of_the_rows_changes_nothing_but_ties(points, random) -> None:
    # Ranges of their own for all points: there are no ties.
    points[:, :3] *= np.linspace(1, 1.1, len(points), dtype=np.float32)[:, None]
    order = np.array(random.sample(range(len(points)), len(points)), np.int64)
    view, score = RangeView(FULL), np.random.default_rng(0).random(72, np.float32)
    image, shuffled = view(Scan.of(points)), view(Scan.of(points[order]))
    distances = image.range[image.pixel >= 0]
    if len(np.unique(distances)) == len(distances):
        np.testing.assert_array_equal(shuffled.image, image.image)
        np.testing.assert_array_equal(shuffled.back(score), image.back(score)[order])
    np.testing.assert_array_equal(shuffled.image[0], image.image[0])


def test_a_pixel_shows_the_columns_of_its_nearest_point_and_a_stand_in_for_gaps() -> None:
    columns = {"doppler": np.array([1.0, 2.0, np.nan]), "radar": np.array([0, 1, 1], np.uint8)}
    xyz = np.array([[9, 0, 0], [3, 0, 0], [0, 9, 0]], np.float32)
    view = RangeView(FULL, channels=("doppler", "radar"), fill_value={"doppler": -0.5})
    image = view(Scan(xyz, fields=columns))
    shown = image.image.reshape(2, -1)
    assert shown[:, image.pixel].T.tolist() == [[2, 1], [2, 1], [-0.5, 1]]
    assert not shown[:, image.winner < 0].any()


def test_the_farthest_point_that_is_valid_has_a_finite_range() -> None:
    image = RangeView(FULL)(Scan.of(np.full((1, 3), 1e6) * [1, 1, 0.5]))
    assert image.image[0].max() == pytest.approx(1.5e6)


def test_the_target_ignores_empty_pixels_and_takes_the_truth_of_what_is_shown() -> None:
    # A drop before a wall, both in one pixel; and a wall alone.
    scan = Scan.of([[9, 0, 0, 1], [3, 0, 0, 1], [0, 9, 0, 1]])
    image = RangeView(FULL)(scan)
    target = image.target(np.array([False, True, False]))
    assert target[image.pixel].tolist() == [1, 1, 0]
    assert (target == IGNORED).sum() == image.size - 2
    assert target.dtype == np.int64


BOUNDS = st.builds(
    Candidates,
    st.tuples(
        st.builds(Bound, st.just("intensity"), least=st.sampled_from([-1.0, 0.0, 1.0])),
        st.builds(Bound, st.just("range"), most=st.sampled_from([2.0, 3.5, 9.0])),
    ),
)


@pytest.mark.parametrize("back_projection", BACK_PROJECTIONS)
@pytest.mark.parametrize("grid", [FULL, FRONT], ids=["full circle", "front"])
@given(points=clouds, candidates=BOUNDS, seed=st.integers(0, 2**32 - 1))
def test_candidates_are_given_scores_of_candidates_alone(
    grid, back_projection, points, candidates, seed
) -> None:
    rng, scan = np.random.default_rng(seed), Scan.of(points)
    score = rng.random(grid.rows * grid.columns, np.float32)
    view = RangeView(grid, back_projection=back_projection)
    whole, image = view(scan), view.with_candidates(candidates)(scan)
    candidate = candidates.among(scan)
    asked = np.array([row >= 0 and candidate[row] for row in whole.winner])

    # The network sees the same, and the same rows are judged.
    for name, array in whole.inputs().items():
        np.testing.assert_array_equal(image.inputs()[name], array)
    np.testing.assert_array_equal(image.judged, whole.judged)
    rain = rng.random(len(scan)) < 0.5
    np.testing.assert_array_equal(image.target(rain), np.where(asked, whole.target(rain), IGNORED))

    back = image.back(score)
    assert not back[~(candidate & whole.judged)].any()
    expected = whole.back(np.where(asked, score, np.float32(0)))
    np.testing.assert_array_equal(back[candidate], expected[candidate])
    # Where all pixels around show candidates, or nothing, the others change nothing.
    among_candidates = candidate & whole.judged
    for row in np.flatnonzero(among_candidates):
        around = pixels_around(grid, int(whole.pixel[row]))
        among_candidates[row] = (asked | (whole.winner < 0))[around].all()
    np.testing.assert_array_equal(back[among_candidates], whole.back(score)[among_candidates])


def pixels_around(grid: SphericalGrid, pixel: int) -> list[int]:
    """The pixels of the window around a pixel."""
    row, column = divmod(pixel, grid.columns)
    rows = range(max(row - REACH, 0), min(row + REACH + 1, grid.rows))
    columns = range(column - REACH, column + REACH + 1)
    if not grid.is_full_circle:
        columns = [number for number in columns if 0 <= number < grid.columns]
    return [above * grid.columns + beside % grid.columns for above in rows for beside in columns]


@pytest.mark.parametrize("case", HARD_CASES)
def test_hard_cases_have_finite_images_and_every_judged_row_an_answer(case) -> None:
    scan = HARD_CASES[case]
    for grid in (grid_of("semantickitti", "test"), FRONT):
        image = RangeView(grid)(scan)
        assert np.isfinite(image.image).all()
        answered = image.back(np.ones(image.size, np.float32))
        np.testing.assert_array_equal(answered, np.float32(image.pixel >= 0))
        assert not answered[~scan.valid].any()


@pytest.mark.parametrize("back_projection", BACK_PROJECTIONS)
@pytest.mark.parametrize("grid", [FULL, FRONT], ids=["full circle", "front"])
@given(points=clouds)
def test_scores_come_back_by_the_named_back_projection(grid, back_projection, points) -> None:
    image = RangeView(grid, back_projection=back_projection)(Scan.of(points))
    on = np.flatnonzero(image.judged)
    projected = ProjectedPoints(image.pixel[on], image.range[on], image.nearest, image.wraps)
    score = np.random.default_rng(0).random(image.size, np.float32)
    expected = np.zeros(len(points), np.float32)
    expected[on] = BACK_PROJECTIONS[back_projection](projected, score)
    np.testing.assert_array_equal(image.back(score), expected)
    assert image.wraps == (grid is FULL)


def labelled(path: Path, snow: int = 110) -> tuple[Scan, Bools]:
    scan = read_scan(path)
    return scan, class_ids(read_labels(label_beside(path), len(scan))) == snow


def iou_of_perfect_pixels(view: RangeView, scan: Scan, rain: Bools) -> float:
    image = view(scan)
    called = image.back((image.target(rain) == 1).astype(np.float32)) > 0.5
    return float((called & rain).sum() / (called | rain).sum())


@pytest.mark.parametrize("fitted_to", ["sample.bin", "sequences/36/velodyne/042223.bin"])
def test_a_perfect_labelling_of_a_fitted_grid_is_nearly_perfect_for_the_points(
    shared, fitted_to
) -> None:
    wads = shared / "data/wads"
    view = RangeView(fit_grid([read_scan(wads / fitted_to)]).grid)
    assert iou_of_perfect_pixels(view, *labelled(wads / "sample.bin")) >= 0.99
    assert iou_of_perfect_pixels(view, *labelled(wads / "sequences/36/velodyne/042241.bin")) >= 0.99


@pytest.mark.parametrize(
    ("grid", "back_projection", "iou"),
    [
        (SphericalGrid.even(64, 2048, (-25, 15)), "copy", 0.403),
        (SphericalGrid.even(64, 2048, (-25, 15)), "nearest range", 0.935),
        (grid_of("wads", "test"), "copy", 0.613),
        (grid_of("wads", "test"), "nearest range", 0.991),
    ],
)
def test_what_published_grids_allow_is_as_measured_elsewhere(
    shared, grid, back_projection, iou
) -> None:
    sample = labelled(shared / "data/wads/sample.bin")
    found = iou_of_perfect_pixels(RangeView(grid, back_projection=back_projection), *sample)
    assert found == pytest.approx(iou, abs=0.001)
