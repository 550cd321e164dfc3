"""Returns are paired with those of their own ray, and with no other's."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from derain.evaluation.hard_cases import hard_cases
from derain.files import read_scan
from derain.scan import Floats, Scan
from derain.simulation.sensor import unit_vectors
from derain.views.directions import FEWEST_PAIRS, TOLERANCES, shared_direction_pairs
from derain.views.return_columns import LEAST_APART
from derain.views.returns import pair_returns

from ..two_returns import Recording

HARD_CASES = dict(hard_cases(largest=3000))
CLEAN = ["kitti_hdl64.bin", "kitti_front.bin", "pandaset_pandar64.pcd", "ouster_os1_128.npz"]


@settings(max_examples=15)
@given(st.integers(0, 2**32), st.floats(0.01, 0.9), st.sampled_from([0.25, 0.3, 1.0]))
def test_the_rays_of_a_sensor_of_two_returns_are_found(seed, share, step) -> None:
    recording = Recording(seed, share, step)
    partner, nearer, farther = recording.truth()
    returns = pair_returns(Scan.of(recording.xyz))
    if nearer.sum() < FEWEST_PAIRS:
        assert not returns.dual
        return
    np.testing.assert_array_equal(returns.partner, partner)
    np.testing.assert_array_equal(returns.nearer, nearer)
    np.testing.assert_array_equal(returns.farther, farther)
    assert returns.found_by == "directions"


def apart(unit: Floats) -> Floats:
    """Angle between any two directions, float64 (M, M), degrees; that to oneself is infinite."""
    chord = np.linalg.norm(unit[:, None] - unit, axis=-1)
    np.fill_diagonal(chord, np.inf)
    return np.degrees(chord)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("noise", [0.0, 0.001, 0.01])
def test_pairs_are_those_of_a_brute_force_search_anywhere_on_the_sphere(seed, noise) -> None:
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
    found = shared_direction_pairs(xyz)
    assert len(found) > 100
    np.testing.assert_array_equal(found[np.lexsort(found.T[::-1])], near[near[:, 0] < near[:, 1]])


@pytest.mark.parametrize("seed", range(2))
def test_the_order_of_the_rows_does_not_matter(seed) -> None:
    recording = Recording(seed)
    order = np.random.default_rng(seed).permutation(len(recording.xyz))
    back = np.argsort(order)
    plain = pair_returns(Scan.of(recording.xyz))
    shuffled = pair_returns(Scan.of(recording.xyz[order]))
    partner = np.where(plain.partner >= 0, back[plain.partner], -1)[order]
    np.testing.assert_array_equal(shuffled.partner, partner)
    np.testing.assert_array_equal(shuffled.nearer, plain.nearer[order])
    np.testing.assert_array_equal(shuffled.farther, plain.farther[order])


def test_rows_written_twice_are_one_return_and_have_the_same_role() -> None:
    recording = Recording(0)
    plain = pair_returns(Scan.of(recording.xyz))
    doubled = pair_returns(Scan.of(np.concatenate([recording.xyz, recording.xyz])))
    for name in ("nearer", "farther", "partner"):
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
    assert (returns.nearer & returns.farther)[last].all()
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
def test_directions_that_agree_by_chance_are_of_no_pair(step) -> None:
    generator = np.random.default_rng(3)
    unit = unit_vectors(*generator.uniform(0, 120 * step, (2, 15_000)))
    xyz = unit * generator.uniform(3, 80, (15_000, 1))
    assert not pair_returns(Scan.of(xyz)).dual


@pytest.mark.parametrize("name", HARD_CASES)
def test_hard_cases_have_an_answer(name) -> None:
    scan = HARD_CASES[name]
    returns = pair_returns(scan)
    has = returns.partner >= 0
    assert returns.partner.shape == returns.nearer.shape == returns.farther.shape == (len(scan),)
    assert returns.partner.max(initial=-1) < len(scan)
    assert (returns.nearer | returns.farther)[has].all()
    assert not (has & ~scan.valid).any()


def test_a_scan_is_paired_once() -> None:
    scan = Scan.of(Recording(0).xyz)
    assert pair_returns(scan) is pair_returns(scan)


@pytest.mark.parametrize("name", CLEAN)
def test_real_scans_of_single_returns_have_no_pair(shared, name) -> None:
    returns = pair_returns(read_scan(shared / "data" / "clean" / name))
    assert not returns.dual
    assert not (returns.nearer | returns.farther).any()
    assert (returns.partner == -1).all()
