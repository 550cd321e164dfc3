"""The filter of conditional random fields against its formulas, point by point; and its bounds."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from derain.evaluation.hard_cases import scene
from derain.files import read_scan
from derain.filters import CRF, FilterDerainer
from derain.filters.airborne import fit_rain_bounds
from derain.filters.crf import _along_the_sweep
from derain.filters.ground import find_ground
from derain.filters.random_field import decide_sequentially
from derain.scan import Bools, Float32s, Floats, Ints, Scan

# Nearer than this to a limit, rounding may decide.
UNCLEAR = 1e-9


class Reference:
    """The formulas as they stand in the paper's program, in plain loops over all pairs.

    Args:
        points: Distinct x, y, z and intensity, float32 (M, 4).
        neighbours: Size of a neighbourhood.

    Attributes:
        is_clear: Whether no verdict hangs on rounding, or on which of two equals comes first.
    """

    def __init__(self, points: Float32s, neighbours: int) -> None:
        self.xyz, self.intensity = points[:, :3].astype(np.float64), points[:, 3]
        self.range = np.linalg.norm(self.xyz, axis=1)
        apart = np.linalg.norm(self.xyz[:, None] - self.xyz[None], axis=2)
        self.near = np.argsort(apart, axis=1)[:, : neighbours + 1]
        self.apart = np.take_along_axis(apart, self.near, axis=1)
        # Of equally near points either may be the neighbour.
        self.is_clear = not (np.diff(self.apart, axis=1) < UNCLEAR).any()
        self.near = self.near[:, :neighbours]
        self.apart = self.apart[:, :neighbours].astype(np.float32).astype(np.float64)

    def scatter(self, row: int) -> float:
        values = np.linalg.eigvalsh(np.cov(self.xyz[self.near[row]].T, bias=True))
        return max(values[0], 0) / values.sum() if values.sum() > 0 else 0

    def published(self) -> Bools:
        candidate = (self.intensity <= 2) & (self.range <= 30) & (self.xyz[:, 2] >= -1.8)
        feature = {
            row: (1 + self.scatter(row))
            * (5 + self.apart[row].mean() / (0.1 + self.range[row]))
            / (1 + max(self.intensity[row].astype(np.float64), 0))
            for row in np.flatnonzero(candidate).tolist()
        }
        spread = max(feature.values(), default=0) - min(feature.values(), default=0)
        if not spread > UNCLEAR:
            return np.zeros(len(self.xyz), bool)
        least = min(feature.values())
        return self.decided({row: 2 * (f - least) / spread - 1 for row, f in feature.items()})

    def fitted(self, candidate: Bools) -> Bools:
        feature = {
            row: (1 + self.scatter(row))
            * (5 + min(self.apart[row].mean() / (0.1 + self.range[row]), 1))
            for row in np.flatnonzero(candidate).tolist()
        }
        return self.decided({row: 2 * (f - 5 / 3) / (8 - 5 / 3) - 1 for row, f in feature.items()})

    def decided(self, feature: dict[int, float]) -> Bools:
        """Judges the candidates in the order of azimuth."""
        azimuth = np.arctan2(self.xyz[:, 1] + 0.0, self.xyz[:, 0])
        self.is_clear &= len(np.unique(azimuth)) == len(azimuth)
        for value in feature.values():
            self.is_clear &= min(abs(value - 0.6), abs(value + 0.4)) > UNCLEAR
        of_all = np.full(len(self.xyz), -1.0)
        rows = np.array([*feature], int)
        of_all[rows] = [*feature.values()]
        place = np.argsort(np.argsort(azimuth[rows]))
        rain, totals = by_loop(of_all, rows, place, self.near[rows], self.apart[rows], 2.0)
        self.is_clear &= all(abs(total) > UNCLEAR for total in totals)
        return rain


def by_loop(
    feature: Floats,
    rows: Ints,
    place: Ints,
    neighbours: Ints,
    distances: NDArray[np.floating],
    vote: float,
) -> tuple[Bools, list[float]]:
    """Decides one point after the other; returns the rain, and the totals that decided."""
    votes = [vote if f > 0.6 else -vote if f < -0.4 else f for f in feature.tolist()]
    rain, totals = feature > 0.6, []
    for number in np.argsort(place).tolist():
        point = int(rows[number])
        if not -0.4 < feature[point] <= 0.6:
            continue
        total = float(feature[point])
        for other, apart in zip(neighbours[number, 1:], distances[number, 1:], strict=True):
            total += votes[other] * (1 / (0.01 + float(apart)))
        totals.append(total)
        rain[point] = total > 0
        votes[point] = vote if total > 0 else -vote
    return rain, totals


@given(
    st.integers(0, 2**32 - 1), st.integers(1, 60), st.integers(1, 8), st.sampled_from([0, 0.3, 2])
)
def test_waves_decide_as_a_loop_does(seed, points, size, vote) -> None:
    generator = np.random.default_rng(seed)
    feature = generator.choice([-1.0, -0.4, -0.39, -0.1, 0.05, 0.1, 0.6, 0.7], points)
    rows = np.flatnonzero((feature > -1) | (generator.random(points) < 0.3))
    neighbours = generator.integers(0, points, (len(rows), size))
    neighbours[:, 0] = rows
    distances = np.sort(generator.choice([0.0, 0.1, 0.5, 3.0], neighbours.shape), axis=1)
    place = generator.permutation(len(rows))
    field = (feature, rows, place, neighbours, distances.astype(np.float32), vote)
    before = [np.copy(each) for each in field]
    np.testing.assert_array_equal(decide_sequentially(*field), by_loop(*field)[0])
    for one, other in zip(before, field, strict=True):
        np.testing.assert_array_equal(one, other)


def test_the_sweep_goes_once_around_from_behind_where_y_is_any_zero() -> None:
    xyz = np.array([[-1, 0.0, 0], [1, 0, 0], [-2, -0.0, 0], [0, -1, 0], [0, 1, 0]])
    assert _along_the_sweep(xyz).tolist() == [3, 1, 4, 0, 2]


@given(st.integers(0, 2**32 - 1), st.integers(1, 60), st.integers(4, 12), st.floats(0.3, 30))
def test_the_published_variant_follows_its_formulas(seed, points, neighbours, size) -> None:
    generator = np.random.default_rng(seed)
    place = generator.normal(size=(points, 3)) * [size, size, 1]
    intensity = generator.choice([0, 0, 1, 1.5, 2, 2.5, 9], points)
    cloud = np.column_stack([place, intensity]).astype(np.float32)
    reference = Reference(cloud, neighbours)
    expected = reference.published()
    assume(reference.is_clear)
    np.testing.assert_array_equal(FilterDerainer(CRF(neighbours, "published"), 1)(cloud), expected)


@pytest.mark.parametrize("seed", range(3))
def test_the_fitted_variant_does_the_same_within_its_own_bounds(seed) -> None:
    scan = Scan.of(scene(1200, seed))
    ground = find_ground(scan.xyz)
    reference = Reference(scene(1200, seed), 8)

    def around(rows: Ints) -> tuple[Ints, Float32s]:
        return reference.near[rows], reference.apart[rows].astype(np.float32)

    above = ground.is_above(scan.xyz)
    bounds = fit_rain_bounds(
        reference.xyz, reference.range, reference.intensity, above, around, 3.0, 2.0
    )
    assert not bounds.is_bright
    assert 3 < bounds.intensity < 6  # drops have 0 to 4, the wall at least 20
    candidate = above & bounds.hold(reference.intensity, reference.range)
    expected = reference.fitted(candidate)
    assert reference.is_clear
    assert 0.01 < expected.mean() < 0.12
    np.testing.assert_array_equal(FilterDerainer(CRF(), 1)(scan), expected)


def iou(found: Bools, rain: Bools) -> float:
    return float((found & rain).sum() / (found | rain).sum())


def drops(points: int) -> Bools:
    """Which points of :func:`scene` are drops."""
    return np.arange(points) >= points - points // 10


def test_neither_the_unit_of_intensity_nor_what_is_brighter_matters() -> None:
    points = scene(6000)
    rain = FilterDerainer(CRF())(points)
    assert iou(rain, drops(6000)) > 0.65
    for factor in (1 / 255, 257.0):
        scaled = points * np.array([1, 1, 1, factor], np.float32)
        np.testing.assert_array_equal(FilterDerainer(CRF())(scaled), rain)
    points[:, 3] = 255 - points[:, 3]
    assert iou(FilterDerainer(CRF())(points), drops(6000)) > 0.65
    assert not FilterDerainer(CRF(variant="published"))(points).any()


@pytest.mark.parametrize("degrees", [-15, 20])
def test_a_sensor_may_be_tilted(degrees) -> None:
    points = scene(6000)
    turn = Rotation.from_euler("y", degrees, degrees=True)
    points[:, :3] = turn.apply(points[:, :3])
    assert iou(FilterDerainer(CRF())(points), drops(6000)) > 0.65


def test_nothing_is_called_rain_without_rain_or_where_it_is_as_bright_as_all_else() -> None:
    alike = scene(6000)
    alike[:, 3] = np.random.default_rng(0).uniform(0, 255, len(alike))
    for points in (scene(6000)[~drops(6000)], alike[~drops(6000)], alike):
        assert not FilterDerainer(CRF())(points).any()


@pytest.mark.parametrize("variant", ["fitted", "published"])
def test_without_intensity_nothing_is_found_and_a_warning_is_given(variant) -> None:
    scan, filter_ = Scan.of(scene()), CRF(variant=variant)
    assert not list(filter_.issues(scan))
    for blind in (replace(scan, intensity=None), replace(scan, intensity=0 * scan.intensity)):
        assert not FilterDerainer(filter_)(blind).any()
        (odd,) = filter_.issues(blind)
        assert "nothing can be found without" in odd.detail


def test_only_the_published_bound_has_a_unit() -> None:
    scan = Scan.of(scene()).with_intensity_times(1 / 255)
    assert not list(CRF().issues(scan))
    (odd,) = CRF(variant="published").issues(scan)
    assert odd.kind == "intensity of a smaller unit"


@pytest.mark.parametrize(("variant", "wanted"), [("published", 0.845), ("fitted", 0.84)])
def test_it_finds_the_snow_of_a_real_scan(shared, variant, wanted) -> None:
    points = np.fromfile(shared / "data/wads/sample.bin", np.float32).reshape(-1, 4)
    label = np.fromfile(shared / "data/wads/sample.label", np.uint32) & 0xFFFF
    assert iou(FilterDerainer(CRF(variant=variant))(points), label == 110) > wanted


@pytest.mark.parametrize(
    "name", ["kitti_hdl64.bin", "kitti_front.bin", "pandaset_pandar64.pcd", "ouster_os1_128.npz"]
)
def test_it_leaves_a_dry_recording_alone(shared, name) -> None:
    assert not FilterDerainer(CRF())(read_scan(shared / "data/clean" / name)).any()
