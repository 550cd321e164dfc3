"""Isolated points: what is crowded is left out, whatever the order; the rest has its neighbours."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from derain.evaluation.hard_cases import hard_cases, scene
from derain.scan import Ints, Scan
from derain.simulation.sensor import unit_vectors
from derain.views.intensity_rank import INTENSITY_RANKS, intensity_rank
from derain.views.isolated_points import (
    FARTHEST,
    FINEST_STEP,
    HALF_AT,
    NEAREST,
    SHELLS,
    WINDOW,
    IsolatedPoints,
    IsolatedPointView,
    beam_step,
    crowding,
)
from derain.views.neighbour_search import NeighbourSearch

VIEW = IsolatedPointView(threads=1)


def wall_and_drops(seed: int = 0, drops: int = 200) -> Scan:
    """A dense wall ahead, and drops in the air before it; labels 0 and 1."""
    generator = np.random.default_rng(seed)
    azimuth, inclination = np.meshgrid(
        np.radians(np.arange(-40, 40, 0.4)), np.radians(np.arange(-10, 10, 0.4))
    )
    y, z = 20 * np.tan(azimuth.ravel()), 20 * np.tan(inclination.ravel())
    # No two are equally far apart, so that nothing hangs on the order of rows.
    wall = np.stack([np.full(len(y), 20.0), y, z], axis=1) + generator.normal(0, 0.01, (len(y), 3))
    flying = generator.uniform((2, -4, -2), (15, 4, 2), (drops, 3))
    intensity = np.concatenate([generator.uniform(40, 200, len(y)), generator.uniform(0, 5, drops)])
    points = np.column_stack([np.concatenate([wall, flying]), intensity]).astype(np.float32)
    return Scan.of(points).with_label(np.repeat([0, 1], [len(y), drops]))


def rows_of(seen: IsolatedPoints) -> Ints:
    """Rows of the scan that are isolated."""
    return seen.first[seen.neighbours[:, 0]]


def test_drops_are_isolated_and_a_wall_is_not() -> None:
    scan = wall_and_drops()
    isolated = np.isin(np.arange(len(scan)), rows_of(VIEW(scan)))
    assert isolated[scan.label == 1].all()
    assert isolated[scan.label == 0].mean() < 0.2


@settings(max_examples=10)
@given(st.integers(0, 2**32 - 1))
def test_what_is_seen_does_not_depend_on_the_order_of_rows(seed) -> None:
    scan = wall_and_drops()
    order = np.random.default_rng(seed).permutation(len(scan))
    seen, shuffled = VIEW(scan), VIEW(scan.take(order))
    np.testing.assert_array_equal(order[rows_of(shuffled)], rows_of(seen))
    for name, array in seen.inputs().items():
        np.testing.assert_array_equal(shuffled.inputs()[name], array)


@pytest.mark.parametrize("apart", [1e-6, 0.001, 0.02])
def test_a_scan_whose_returns_are_written_twice_is_seen_as_if_they_were_written_once(apart) -> None:
    scan = wall_and_drops()
    wide = scan.xyz.astype(np.float64)
    behind = wide * (1 + apart / np.linalg.norm(wide, axis=1, keepdims=True))
    rows = np.resize(np.arange(len(scan)), 2 * len(scan))
    twice = replace(scan.take(rows), xyz=np.concatenate([wide, behind]).astype(np.float32))
    once, seen = VIEW(scan), VIEW(twice)
    assert len(seen.points) == len(once.points)
    np.testing.assert_array_equal(seen.counts, once.counts)
    assert seen.step[0] == pytest.approx(once.step[0], rel=0.02)
    # Copies a little farther out lie along another curve, which sees some others crowded.
    assert len(np.setxor1d(rows_of(seen), rows_of(once))) < 0.1 * once.size
    assert np.isin(np.flatnonzero(scan.label == 1), rows_of(seen)).all()
    score = np.arange(1, seen.size + 1, dtype=np.float32)
    first, second = seen.back(score).reshape(2, -1)
    np.testing.assert_array_equal(second, first)


def test_neighbours_are_the_nearest_of_all_points_and_of_equally_near_ones_the_first_row() -> None:
    lattice = np.stack(np.meshgrid(*3 * [np.arange(10.0)]), axis=-1).reshape(-1, 3) * 3 + 5
    xyz = np.random.default_rng(0).permutation(lattice).astype(np.float32)
    seen = VIEW(Scan(xyz))
    rows = seen.first[seen.neighbours]
    squared = np.square(xyz[:, None].astype(np.float64) - xyz).sum(axis=2)
    nearest = np.argsort(squared, axis=1, kind="stable")[:, : VIEW.neighbours]
    np.testing.assert_array_equal(rows, nearest[rows[:, 0]])
    np.testing.assert_allclose(seen.distances, np.sqrt(squared[rows[:, :1], rows]), rtol=1e-6)
    assert len(rows) > 20


def test_scores_go_to_isolated_points_and_0_to_all_others() -> None:
    scan = wall_and_drops()
    seen = VIEW(scan)
    target = seen.target(scan.label == 1)
    np.testing.assert_array_equal(target, (scan.label == 1)[rows_of(seen)])
    back = seen.back(np.ones(seen.size, np.float32))
    assert back.sum() == seen.size
    assert (back[rows_of(seen)] == 1).all()
    assert seen.judged.all()


def test_points_are_counted_by_range_and_rank() -> None:
    scan = wall_and_drops()
    seen = VIEW(scan)
    rank, distance = intensity_rank(scan), np.linalg.norm(scan.xyz, axis=1)
    edges = np.geomspace(NEAREST, FARTHEST, SHELLS + 1)[1:-1]
    shell = np.digitize(distance, edges)
    expected, *_ = np.histogram2d(
        shell, rank, [np.arange(SHELLS + 1) - 0.5, np.arange(INTENSITY_RANKS + 1) - 0.5]
    )
    np.testing.assert_array_equal(seen.counts[0], expected)
    np.testing.assert_array_equal(seen.cell, (shell * INTENSITY_RANKS + rank)[seen.first])


@pytest.mark.parametrize(("name", "scan"), list(hard_cases(2000)))
def test_hard_scans_are_viewed(name, scan) -> None:
    seen = VIEW(scan)
    assert (seen.judged == (scan.valid & (name != "all points identical"))).all()
    assert all(np.isfinite(array).all() for array in seen.inputs().values())
    assert seen.counts.sum() == len(seen.points)


def test_crowding_is_what_is_near_along_the_curve_and_near_the_least_crowded_there() -> None:
    xyz = scene(300)[:, :3].astype(np.float32)
    step = 0.01
    distance = np.linalg.norm(xyz, axis=1)
    near = np.zeros(len(xyz))
    windows = [slice(max(one - WINDOW, 0), one + WINDOW + 1) for one in range(len(xyz))]
    for one, window in enumerate(windows):
        steps = np.linalg.norm(xyz[window] - xyz[one], axis=1) / (distance[one] * step)
        near[one] = (1 / (1 + (steps / HALF_AT) ** 2)).sum() - 1  # without the point itself
    expected = near + [near[window].min() for window in windows]
    np.testing.assert_allclose(crowding(xyz, step), expected, rtol=1e-4, atol=1e-6)
    assert not crowding(xyz[:1], step).any()


@pytest.mark.parametrize("degrees", [0.1, 0.4, 2.0])
def test_the_step_is_that_of_the_beams(degrees) -> None:
    angle = np.arange(-20, 20) * degrees
    xyz = (15 * unit_vectors(angle, angle[:, None])).astype(np.float32)
    neighbours, _ = NeighbourSearch(xyz)(4)
    step = beam_step(xyz, np.arange(len(xyz)), neighbours)
    assert step == pytest.approx(np.radians(degrees), rel=0.1)
    assert beam_step(xyz[:1], np.arange(1), neighbours[:1]) >= FINEST_STEP
