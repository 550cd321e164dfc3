"""Returns are paired with those of their own ray, and with no other's."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from derain.evaluation.hard_cases import hard_cases
from derain.files import read_scan
from derain.scan import Scan
from derain.views.return_columns import LEAST_APART, stated_returns
from derain.views.returns import RayReturns, pair_returns
from derain.views.shared_directions import FEWEST_PAIRS, TOLERANCES, one_direction

from ..two_returns import Recording

HARD_CASES = dict(hard_cases(largest=3000))
CLEAN = ["kitti_hdl64.bin", "kitti_front.bin", "pandaset_pandar64.pcd", "ouster_os1_128.npz"]


def assert_same(found: RayReturns, expected: RayReturns) -> None:
    for name in ("nearer", "farther", "partner", "partner_range", "told_by"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), err_msg=name)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32), st.floats(0.01, 0.9), st.sampled_from([0.25, 0.3, 1.0]))
def test_the_rays_of_a_sensor_of_two_returns_are_found(
    seed: int, share: float, step: float
) -> None:
    recording = Recording(seed, share, step)
    partner, nearer, farther = recording.truth()
    returns = pair_returns(Scan.of(recording.xyz))
    if nearer.sum() < FEWEST_PAIRS:
        assert not returns.dual
        return
    np.testing.assert_array_equal(returns.partner, partner)
    np.testing.assert_array_equal(returns.nearer, nearer)
    np.testing.assert_array_equal(returns.farther, farther)
    np.testing.assert_array_equal(returns.count, 1 + recording.two)
    np.testing.assert_allclose(
        returns.partner_range[recording.two], recording.distance[partner[recording.two]], rtol=1e-5
    )
    assert np.isnan(returns.partner_range[~recording.two]).all()
    assert returns.told_by == "directions"


def apart(unit: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angle between any two directions, float64 (M, M), degrees; that to oneself is infinite."""
    chord = np.linalg.norm(unit[:, None] - unit, axis=-1)
    np.fill_diagonal(chord, np.inf)
    return np.degrees(chord)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("noise", [0.0, 0.001, 0.01])
def test_pairs_are_those_of_a_brute_force_search_anywhere_on_the_sphere(
    seed: int, noise: float
) -> None:
    generator = np.random.default_rng(seed)
    unit = generator.normal(size=(900, 3))
    unit[::3] *= [0.03, 0.03, 1]  # about the poles
    unit[1::3] *= [-1, 1e-5, 0.3]  # about the seam of the circle
    unit[1::3, 0] = -np.abs(unit[1::3, 0])
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)
    unit = unit[apart(unit).min(axis=1) > 3 * TOLERANCES[0]]
    twins = unit[::2] + np.radians(noise) * generator.uniform(-0.5, 0.5, (len(unit[::2]), 3))
    unit = np.concatenate([unit, twins / np.linalg.norm(twins, axis=1, keepdims=True)])
    near = np.argwhere(apart(unit) < 2 * TOLERANCES[0])
    xyz = (unit * generator.uniform(1, 90, (len(unit), 1))).astype(np.float32)
    found = one_direction(xyz)
    assert len(found) > 100
    np.testing.assert_array_equal(found[np.lexsort(found.T[::-1])], near[near[:, 0] < near[:, 1]])


@pytest.mark.parametrize("seed", range(5))
def test_the_order_of_the_rows_does_not_matter(seed: int) -> None:
    recording = Recording(seed)
    order = np.random.default_rng(seed).permutation(len(recording.xyz))
    back = np.argsort(order)
    plain = pair_returns(Scan.of(recording.xyz))
    shuffled = pair_returns(Scan.of(recording.xyz[order]))
    partner = np.where(plain.partner >= 0, back[plain.partner], -1)[order]
    np.testing.assert_array_equal(shuffled.partner, partner)
    np.testing.assert_array_equal(shuffled.nearer, plain.nearer[order])
    np.testing.assert_array_equal(shuffled.farther, plain.farther[order])


def test_rows_written_twice_are_one_return_each_of_which_is_told_the_same() -> None:
    recording = Recording(0)
    plain = pair_returns(Scan.of(recording.xyz))
    doubled = pair_returns(Scan.of(np.concatenate([recording.xyz, recording.xyz])))
    for name in ("nearer", "farther", "partner", "partner_range"):
        np.testing.assert_array_equal(getattr(doubled, name), np.tile(getattr(plain, name), 2))


def test_returns_nearer_to_each_other_than_a_surface_is_deep_are_one() -> None:
    recording = Recording(0)
    partner, nearer, _ = recording.truth()
    near = np.flatnonzero(nearer)
    xyz = recording.xyz.copy()
    close = near[::2]
    factor = (recording.distance[close] + LEAST_APART / 2) / recording.distance[close]
    xyz[partner[close]] = xyz[close] * factor[:, None].astype(np.float32)
    returns = pair_returns(Scan.of(xyz))
    np.testing.assert_array_equal(np.flatnonzero(returns.nearer), np.sort(near[1::2]))


def test_three_returns_of_a_ray_are_linked_one_behind_the_other() -> None:
    recording = Recording(0, share=0.3)
    partner, _, farther = recording.truth()
    last = np.flatnonzero(farther)
    xyz = np.concatenate([recording.xyz, recording.xyz[last] * np.float32(1.5)])
    returns = pair_returns(Scan.of(xyz))
    third = len(recording.xyz) + np.arange(len(last))
    np.testing.assert_array_equal(returns.count[last], 3)
    np.testing.assert_array_equal(returns.partner[partner[last]], last)
    np.testing.assert_array_equal(returns.partner[last], third)
    np.testing.assert_array_equal(returns.partner[third], last)
    assert not returns.nearer[third].any()
    assert returns.farther[third].all()


def test_a_radars_detections_are_of_no_ray() -> None:
    recording = Recording(0)
    _, _, farther = recording.truth()
    scan = Scan.of(recording.xyz)
    fused = Scan(scan.xyz, radar=farther)
    assert pair_returns(scan).dual
    assert not pair_returns(fused).dual


@pytest.mark.parametrize("step", [0.011, 0.03, 0.049, 0.2])
def test_directions_that_agree_by_chance_are_of_no_pair(step: float) -> None:
    generator = np.random.default_rng(3)
    width = 120 * step
    azimuth, inclination = np.radians(generator.uniform(0, width, (2, 15_000)))
    flat = np.cos(inclination)
    unit = np.stack([np.cos(azimuth) * flat, np.sin(azimuth) * flat, np.sin(inclination)], axis=1)
    xyz = unit * generator.uniform(3, 80, (15_000, 1))
    assert not pair_returns(Scan.of(xyz)).dual


@pytest.mark.parametrize("name", HARD_CASES)
def test_hard_cases_have_an_answer(name: str) -> None:
    scan = HARD_CASES[name]
    returns = pair_returns(scan)
    has = returns.partner >= 0
    assert returns.partner.shape == returns.nearer.shape == returns.farther.shape == (len(scan),)
    assert returns.partner.max(initial=-1) < len(scan)
    assert (returns.nearer | returns.farther)[has].all()
    assert not (has & ~scan.valid).any()
    assert np.isfinite(returns.partner_range[has]).all()
    assert np.isnan(returns.partner_range[~has]).all()


def test_a_scan_is_paired_once() -> None:
    scan = Scan.of(Recording(0).xyz)
    assert pair_returns(scan) is pair_returns(scan)


def with_columns(recording: Recording, **columns: NDArray[Any]) -> Scan:
    return Scan(recording.xyz, fields=columns)


def numbers(recording: Recording) -> NDArray[np.uint8]:
    """1 for the first return of a ray, 2 for the second."""
    _, _, farther = recording.truth()
    return (1 + farther).astype(np.uint8)


def of_las(recording: Recording) -> dict[str, NDArray[Any]]:
    counts = (1 + recording.two).astype(np.uint8)
    return {"return_number": numbers(recording), "number_of_returns": counts}


def of_las_bits(recording: Recording) -> dict[str, NDArray[Any]]:
    counts = (1 + recording.two).astype(np.uint8)
    flags = np.zeros(len(counts), np.uint8)
    return {"bit_fields": numbers(recording) | counts << 4, "classification_flags": flags}


def of_old_las_bits(recording: Recording) -> dict[str, NDArray[Any]]:
    counts = (1 + recording.two).astype(np.uint8)
    return {"bit_fields": numbers(recording) | counts << 3 | 0b01000000}


def of_nebula(recording: Recording) -> dict[str, NDArray[Any]]:
    first = np.where(recording.ray % 2, 4, 9)
    kind = np.where(numbers(recording) == 2, np.where(recording.ray % 2, 10, 5), first)
    return {"return_type": np.where(recording.two, kind, 6).astype(np.uint8)}


def of_autoware(recording: Recording) -> dict[str, NDArray[Any]]:
    first = np.where(recording.ray % 2, 3, 5)
    kind = np.where(numbers(recording) == 2, np.where(recording.ray % 2, 6, 4), first)
    return {"return_type": np.where(recording.two, kind, 7).astype(np.uint8)}


def of_livox(recording: Recording) -> dict[str, NDArray[Any]]:
    return {"tag": (numbers(recording) - 1 << 4 | recording.ray % 16).astype(np.uint8)}


def of_echoes(recording: Recording) -> dict[str, NDArray[Any]]:
    return {"Echo": numbers(recording).astype(np.float32)}


STATED = [of_las, of_las_bits, of_old_las_bits, of_nebula, of_autoware, of_livox, of_echoes]
Columns = Callable[[Recording], dict[str, NDArray[Any]]]


@pytest.mark.parametrize("columns", STATED)
def test_what_the_file_says_is_what_directions_say(columns: Columns) -> None:
    recording = Recording(1)
    scan = with_columns(recording, **columns(recording))
    by_directions = pair_returns(Scan.of(recording.xyz))
    stated = pair_returns(scan)
    assert stated.told_by in {name.lower() for name in scan.fields}
    for name in ("nearer", "farther", "partner", "partner_range"):
        np.testing.assert_array_equal(getattr(stated, name), getattr(by_directions, name))


@pytest.mark.parametrize("columns", STATED)
def test_a_return_whose_partner_is_not_in_the_file_is_known_by_its_column(columns: Columns) -> None:
    recording = Recording(2)
    _, nearer, farther = recording.truth()
    whole = with_columns(recording, **columns(recording))
    # Of every ray with two returns one is left out: of some the nearer, of the others the farther.
    kept = ~np.where(recording.ray % 3 == 0, nearer, farther)
    returns = pair_returns(whole.take(kept))
    assert (returns.partner == -1).all()
    np.testing.assert_array_equal(returns.farther, farther[kept])
    knows_of_more = columns not in (of_livox, of_echoes)
    np.testing.assert_array_equal(returns.nearer, nearer[kept] & knows_of_more)


def test_what_the_file_says_counts_more_than_directions() -> None:
    recording = Recording(3)
    partner, _, _ = recording.truth()
    columns = of_las(recording)
    single = recording.ray % 2 == 0
    columns["number_of_returns"][single] = columns["return_number"][single] = 1
    returns = pair_returns(with_columns(recording, **columns))
    np.testing.assert_array_equal(returns.partner, np.where(single, -1, partner))
    assert not (returns.nearer | returns.farther)[single].any()


def test_a_column_that_counts_inwards_is_taken_the_other_way_round() -> None:
    recording = Recording(4)
    _, nearer, farther = recording.truth()
    columns = of_las(recording)
    two = recording.two
    columns["return_number"][two] = 3 - columns["return_number"][two]
    gone = farther & (recording.ray % 2 == 0)  # of these rays only the nearer is left
    returns = pair_returns(with_columns(recording, **columns).take(~gone))
    np.testing.assert_array_equal(returns.nearer, nearer[~gone])
    np.testing.assert_array_equal(returns.farther, farther[~gone])


@pytest.mark.parametrize(
    "column",
    [
        {"return_number": np.ones(10, np.uint8), "number_of_returns": np.ones(10, np.uint8)},
        {"return_number": np.zeros(10), "number_of_returns": np.full(10, np.nan)},
        {"return_type": np.full(10, 3, np.uint8)},
        {"return_type": np.arange(10) % 3},
        {"tag": np.full(10, 0b101, np.uint8)},
        {"bit_fields": np.full(10, 0b01001001, np.uint8)},
        {"bit_fields": np.full(10, 0b10010001)},
        {"tag": np.linspace(0, 99, 10)},
        {"echo": np.full(10, np.inf)},
        {"range": np.ones(10), "range2": np.zeros(10)},
        {"range": np.zeros(10), "range2": np.ones(10)},
    ],
)
def test_a_column_that_tells_nothing_counts_for_nothing(column: dict[str, NDArray[Any]]) -> None:
    scan = Scan(np.random.default_rng(0).normal(5, 1, (10, 3)).astype(np.float32), fields=column)
    assert stated_returns(scan) is None
    assert_same(pair_returns(scan), RayReturns.single(10))


def test_a_second_return_in_the_row_of_the_first_is_known_by_its_range() -> None:
    xyz = np.array([[10, 0, 0], [0, 20, 0], [0, 0, 5], [7, 0, 0]], np.float32)
    columns = {"range": np.array([9990, 20_000, 5000, 0]), "range2": np.array([29_970, 4000, 0, 9])}
    returns = pair_returns(Scan(xyz, fields=columns))
    assert returns.told_by == "range2"
    assert returns.nearer.tolist() == [True, False, False, False]
    assert returns.farther.tolist() == [False, True, False, False]
    assert (returns.partner == -1).all()
    np.testing.assert_allclose(returns.partner_range, [30, 4, np.nan, np.nan], rtol=1e-6)


def test_ranges_that_no_sensor_measures_are_no_second_return() -> None:
    columns = {"range": np.array([1e-300, 1, np.nan, 1]), "range2": np.array([1e300, 1e9, 1, 1.5])}
    returns = pair_returns(Scan(np.full((4, 3), 9, np.float32), fields=columns))
    assert returns.nearer.tolist() == [False, False, False, True]
    assert not returns.farther.any()
    assert np.isnan(returns.partner_range[:3]).all()


@pytest.mark.parametrize("name", CLEAN)
def test_real_scans_of_single_returns_have_no_pair(shared: Path, name: str) -> None:
    returns = pair_returns(read_scan(shared / "data" / "clean" / name))
    assert_same(returns, RayReturns.single(len(returns.nearer)))


def test_ousters_second_returns_lie_behind_the_first_or_in_front(shared: Path) -> None:
    scan = read_scan(shared / "data" / "clean" / "ouster_os0_32_dual.npz")
    first, second = (scan.fields[name].astype(np.int64) for name in ("range", "range2"))
    returns = pair_returns(scan)
    both = scan.valid & (second > 0)
    assert both.sum() > 50
    np.testing.assert_array_equal(returns.nearer, both & (second > first))
    np.testing.assert_array_equal(returns.farther, both & (second < first))
    # The beams start some millimetres from the middle, which the coordinates are seen from.
    np.testing.assert_allclose(returns.partner_range[both], second[both] / 1000, rtol=0.02)


def test_the_types_of_the_velodyne_file_are_told_by_its_geometry(shared: Path) -> None:
    scan = read_scan(shared / "data" / "clean" / "velodyne_vlp16_dual.pcd")
    returns = pair_returns(scan)
    # Of its driver, "last" is the nearer of two: all that lie in one direction say so.
    np.testing.assert_array_equal(returns.nearer, np.isin(scan.fields["return_type"], (5, 10)))
    paired = np.flatnonzero(returns.partner >= 0)
    nearer = scan.range[returns.partner[paired]] > scan.range[paired]
    np.testing.assert_array_equal(nearer, returns.nearer[paired])
