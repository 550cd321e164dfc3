"""The neighbour view against brute force, in every order and with every trouble."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from derain.evaluation.hard_cases import scene
from derain.scan import Float32s, Ints, Scan
from derain.views.candidates import Bound, Candidates
from derain.views.channels import filled_values
from derain.views.morton import distinct_positions, distinct_rows, first_rows, morton_code
from derain.views.neighbour_search import NeighbourSearch
from derain.views.neighbours import NeighbourView

# Few values on a coarse grid: many duplicates and many equal distances.
gridded = hnp.arrays(
    np.float32, st.tuples(st.integers(0, 60), st.just(3)), elements=st.integers(-3, 3).map(float)
)
scattered = hnp.arrays(
    np.float32,
    st.tuples(st.integers(0, 60), st.just(3)),
    elements=st.floats(-200, 200, width=32).map(lambda value: round(value, 3)),
)


def brute_force(xyz: Float32s, k: int) -> tuple[Ints, Float32s]:
    squared = ((xyz[:, None].astype(np.float64) - xyz[None].astype(np.float64)) ** 2).sum(axis=2)
    rank = np.broadcast_to(np.arange(len(xyz)), squared.shape)
    order = np.lexsort((rank, squared))[:, : min(k, len(xyz))]
    order = np.pad(order, ((0, 0), (0, k - order.shape[1])), mode="edge")
    return order, np.sqrt(np.take_along_axis(squared, order, axis=1)).astype(np.float32)


@pytest.mark.parametrize("clouds", [gridded, scattered], ids=["gridded", "scattered"])
@given(data=st.data(), k=st.integers(1, 12))
def test_neighbours_equal_brute_force(clouds, data, k) -> None:
    xyz = np.unique(data.draw(clouds), axis=0)
    if not len(xyz):
        assert NeighbourSearch(xyz)(k)[0].shape == (0, k)
        return
    neighbours, distances = NeighbourSearch(xyz)(k)
    expected, expected_distances = brute_force(xyz, k)
    np.testing.assert_array_equal(neighbours, expected)
    np.testing.assert_allclose(distances, expected_distances, rtol=1e-6, atol=1e-12)


@given(gridded, st.randoms(use_true_random=False))
def test_the_answer_does_not_depend_on_the_order_inside(xyz, random) -> None:
    xyz = np.unique(xyz, axis=0)
    if not len(xyz):
        return
    shuffle = np.array(random.sample(range(len(xyz)), len(xyz)))
    neighbours, _ = NeighbourSearch(xyz)(5)
    shuffled, _ = NeighbourSearch(xyz[shuffle], rank=shuffle)(5)
    np.testing.assert_array_equal(shuffle[shuffled], neighbours[shuffle])


@given(gridded.map(lambda xyz: xyz[:20]), st.randoms(use_true_random=False))
def test_distinct_rows_are_those_of_the_rows_that_can_be_judged(xyz, random) -> None:
    lost = np.array([random.random() < 0.3 for _ in xyz], bool)
    scan = Scan(np.where(lost[:, None], np.float32(np.nan), xyz))
    seen: dict[bytes, int] = {}
    for row in np.flatnonzero(scan.valid):
        seen.setdefault((scan.xyz[row] + 0).tobytes(), row)
    first, inverse = distinct_rows(scan)
    assert sorted(first) == list(seen.values())
    assert first_rows(scan).tolist() == list(seen.values())
    np.testing.assert_array_equal(inverse < 0, ~scan.valid)
    np.testing.assert_array_equal(scan.xyz[first][inverse[scan.valid]], scan.xyz[scan.valid])


@given(gridded, st.randoms(use_true_random=False))
def test_a_position_of_more_rows_than_copies_is_no_point(xyz, random) -> None:
    place = np.float32([[9, 0, 1]])
    xyz = np.unique(xyz, axis=0)
    some, many = (np.vstack([xyz, np.repeat(place, n, axis=0)]) for n in (20, 21))
    order = random.sample(range(len(many)), len(many))
    assert (distinct_rows(Scan(some))[1] >= 0).sum() == Scan(xyz).valid.sum() + 20
    first, inverse = distinct_rows(Scan(many[order]))
    at_place = (many[order] == place).all(axis=1)
    np.testing.assert_array_equal(inverse < 0, ~Scan(many[order]).valid | at_place)
    assert not at_place[first].any()
    seen = inverse >= 0
    np.testing.assert_array_equal(many[order][first][inverse[seen]], many[order][seen])


def test_equal_points_apart_in_one_crowded_cell_are_found() -> None:
    # Two outliers share a cell: they make the cells 15 cm wide, so that all other points share one.
    rng = np.random.default_rng(0)
    cluster = rng.choice(np.linspace(0, 0.01, 5, dtype=np.float32), (500, 3))
    xyz = np.vstack([cluster, [[1e4, 0, 0], [1e4, 0, 0.01]]]).astype(np.float32)
    assert len(np.unique(morton_code(xyz))) == 2
    first, inverse = distinct_positions(xyz)
    assert sorted(first) == sorted(np.unique(xyz, axis=0, return_index=True)[1])
    np.testing.assert_array_equal(xyz[first][inverse], xyz)


def test_the_curve_follows_the_interleaved_bits() -> None:
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], np.float32)
    assert np.array_equal(np.argsort(morton_code(corners)), np.arange(8))


def test_a_point_comes_first_in_its_own_neighbourhood_even_among_duplicates() -> None:
    xyz = np.repeat(np.random.default_rng(1).normal(size=(40, 3)).astype(np.float32), 3, axis=0)
    view = NeighbourView()(Scan.of(np.c_[xyz, np.ones(len(xyz))]))
    assert len(view.points) == 40
    np.testing.assert_array_equal(view.neighbours[:, 0], np.arange(40))
    assert (view.distances[:, 1:] > 0).all()


def test_rows_at_one_position_get_one_answer_and_invalid_rows_get_zero() -> None:
    points = [[1, 2, 3, 4], [np.nan, 0, 0, 0], [5, 6, 7, 8], [1, 2, 3, 4], [0, 0, 0, 9]]
    view = NeighbourView()(Scan.of(points))
    score = np.arange(1, 1 + len(view.points), dtype=np.float32)
    back = view.back(score)
    assert back[0] == back[3] > 0
    assert back[2] > 0
    assert back[2] != back[0]
    assert back[1] == back[4] == 0


def test_points_hold_the_channels_asked_for_which_do_not_change_who_is_near() -> None:
    rng = np.random.default_rng(5)
    xyz = rng.normal(size=(50, 3)).astype(np.float32)
    scan = Scan(xyz, fields={"rcs": np.where(np.arange(50) < 20, np.nan, rng.normal(size=50))})
    channels, fill_value = ("rcs", "range", "z", "intensity"), {"rcs": 7.5, "intensity": 9.5}
    view = NeighbourView(channels=channels, fill_value=fill_value)(scan)
    expected = filled_values(scan, view.first, channels, fill_value)
    np.testing.assert_array_equal(view.points, expected)
    usual = NeighbourView()(scan)
    np.testing.assert_array_equal(view.neighbours, usual.neighbours)
    np.testing.assert_array_equal(view.distances, usual.distances)


# In a scene, these hold the drops and some of the road.
NEAR_AND_LOW = Candidates((Bound("range", most=15.0), Bound("intensity", most=30.0)))


@given(st.integers(0, 200), st.integers(0, 50), st.integers(1, 9), st.floats(0, 60))
def test_candidates_have_the_neighbourhoods_that_they_have_among_all(
    points, seed, k, farthest
) -> None:
    scan = Scan.of(np.repeat(scene(points + 10, seed)[:points], 2, axis=0))
    candidates = Candidates((Bound("range", most=farthest),))
    view = NeighbourView(k)
    whole, part = view(scan), view.with_candidates(candidates)(scan)
    candidate = np.flatnonzero(candidates.among(scan)[whole.first])
    assert part.size == len(part.candidates) == len(candidate)
    np.testing.assert_array_equal(part.points, whole.points)
    # Whose neighbourhoods there are: first those of the candidates.
    centres = part.neighbours[:, 0]
    np.testing.assert_array_equal(centres[: part.size], candidate)
    assert set(centres) == set(candidate) | set(whole.neighbours[candidate].ravel())
    assert len(set(centres)) == len(centres)
    np.testing.assert_array_equal(part.neighbours, whole.neighbours[centres])
    np.testing.assert_array_equal(part.distances, whole.distances[centres])
    np.testing.assert_array_equal(centres[part.candidates], whole.neighbours[candidate])


def test_candidates_get_their_own_score_and_all_else_gets_none() -> None:
    scan = Scan.of(np.concatenate([scene(300), scene(100), np.full((5, 4), np.nan)]))
    whole = NeighbourView()(scan)
    part = NeighbourView(candidates=NEAR_AND_LOW)(scan)
    rain = np.random.default_rng(0).random(len(scan)) < 0.5
    among = NEAR_AND_LOW.among(scan)[whole.first]
    np.testing.assert_array_equal(part.target(rain), whole.target(rain)[among])
    score = np.random.default_rng(1).random(len(whole.points)).astype(np.float32)
    expected = whole.back(np.where(among, score, np.float32(0)))
    np.testing.assert_array_equal(part.back(score[among]), expected)
    np.testing.assert_array_equal(part.judged, whole.judged)


def test_a_real_scan_agrees_with_scikit_learn(shared) -> None:
    from sklearn.neighbors import KDTree

    points = np.fromfile(shared / "data/wads/sample.bin", np.float32).reshape(-1, 4)
    view = NeighbourView()(Scan.of(points))
    assert sorted(view.first) == list(range(len(points)))
    some = np.random.default_rng(4).choice(len(points), 3000, replace=False)
    distances, neighbours = KDTree(points[:, :3]).query(points[some, :3], 9)
    rows = view.inverse[some]
    np.testing.assert_allclose(view.distances[rows], distances, atol=1e-5)
    assert (view.first[view.neighbours[rows]] == neighbours).mean() > 0.9999
