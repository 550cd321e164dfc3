"""Every filter against its definition, worked out from all pairs of points; two against Open3D."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from derain.evaluation.hard_cases import scene
from derain.filters import DROR, DSOR, ROR, SOR, SSR, FilterDerainer, PointFilter, filter_view
from derain.filters.radius_filters import has_few_neighbours
from derain.scan import Float32s, Floats, Ints, Scan
from derain.views.morton import MOST_COPIES


def with_few_copies(cloud: Float32s) -> Float32s:
    """The rows of a cloud but those of which there are more than copies of one point."""
    _, place, times = np.unique(cloud[:, :3], axis=0, return_inverse=True, return_counts=True)
    return cloud[times[place.reshape(-1)] <= MOST_COPIES]


# Few values on a coarse grid: copies, equal distances, points at the origin, radii that are met
# exactly. Few points: neighbourhoods larger than the scan.
gridded = hnp.arrays(
    np.float32,
    st.tuples(st.integers(0, 25), st.just(4)),
    elements=st.integers(-6, 6).map(lambda value: value / 2),
).map(with_few_copies)
scattered = hnp.arrays(
    np.float32,
    st.tuples(st.integers(0, 60), st.just(4)),
    elements=st.floats(-20, 20, width=32).map(lambda value: round(value, 3)),
).map(with_few_copies)
clouds = st.one_of(gridded, scattered)
counts = st.integers(2, 12)

# Which side of a limit a point falls on must not hang on rounding.
UNCLEAR = 1e-6


def pairs(xyz: Float32s) -> Floats:
    """Distances of all pairs, float64 (M, M)."""
    exact = xyz.astype(np.float64)
    return np.sqrt(np.square(exact[:, None] - exact[None]).sum(axis=2))


def positions(scan: Scan) -> tuple[Float32s, Ints, Ints]:
    """Distinct valid positions, the first row at each, and the position of each valid row."""
    valid = np.flatnonzero(scan.valid)
    xyz, first, inverse = np.unique(scan.xyz[valid], axis=0, return_index=True, return_inverse=True)
    return xyz, valid[first], inverse.reshape(-1)


def check(scan: Scan, filter_: PointFilter, value: Floats, limit: Floats) -> None:
    """Compares verdicts on all rows whose position's value is clearly off its limit.

    Rain is what lies above the limit.
    """
    expected = np.zeros(len(scan), bool)
    unclear = np.zeros(len(scan), bool)
    _, _, inverse = positions(scan)
    expected[scan.valid] = (value > limit)[inverse]
    unclear[scan.valid] = (np.abs(value - limit) <= UNCLEAR * np.abs(limit))[inverse]
    wrong = FilterDerainer(filter_)(scan) != expected
    assert not (wrong & ~unclear).any()


def mean_of_nearest(xyz: Float32s, neighbours: int) -> Floats:
    return np.sort(pairs(xyz), axis=1)[:, 1:neighbours].mean(axis=1)


@given(gridded, counts, st.sampled_from([0.0, 0.5, 1.0, 2.5, 7.3]))
def test_ror_counts_the_points_within_its_radius(cloud, neighbours, radius) -> None:
    scan = Scan.of(cloud)
    xyz, _, inverse = positions(scan)
    expected = np.zeros(len(scan), bool)
    # On the grid, distances that meet a radius do so exactly: a point there is within.
    expected[scan.valid] = ((pairs(xyz) <= radius).sum(axis=1) < neighbours)[inverse]
    np.testing.assert_array_equal(FilterDerainer(ROR(neighbours, radius))(scan), expected)


def test_a_point_at_exactly_the_radius_is_within() -> None:
    line = np.column_stack([np.arange(1, 9), np.zeros((8, 3))]).astype(np.float32)
    ror, expected = ROR(3, 1.0), [True] + [False] * 6 + [True]
    assert FilterDerainer(ror)(line).tolist() == expected
    view = filter_view(3, threads=1)(Scan.of(line))  # as it shares it with other filters
    assert ror.judge(view)[view.inverse].tolist() == expected


@given(
    cloud=clouds,
    neighbours=counts,
    azimuth=st.sampled_from([0.0, 0.4, 5.0, 30.0]),
    minimum=st.sampled_from([0.0, 0.3, 1.2]),
    variant=st.sampled_from(["code", "paper"]),
)
def test_dror_counts_the_points_within_a_radius_that_grows_with_range(
    cloud, neighbours, azimuth, minimum, variant
) -> None:
    scan = Scan.of(cloud)
    xyz, _, _ = positions(scan)
    horizontal = np.hypot(*xyz[:, :2].T.astype(np.float64))
    spacing = {"code": 2 * np.sin(np.radians(azimuth)), "paper": np.radians(azimuth)}[variant]
    radius = np.maximum(1.5 * horizontal * spacing, minimum)
    nearest = np.sort(pairs(xyz), axis=1)
    last = nearest[:, neighbours - 1] if len(xyz) >= neighbours else np.full(len(xyz), np.inf)
    check(scan, DROR(neighbours, 1.5, azimuth, minimum, variant), last, radius)


@given(cloud=clouds, neighbours=counts, deviations=st.sampled_from([0.0, 0.01, 1.5]))
def test_sor_compares_mean_distances_with_their_mean_and_deviation(
    cloud, neighbours, deviations
) -> None:
    scan = Scan.of(cloud)
    xyz, _, _ = positions(scan)
    if len(xyz) < 2:
        assert not FilterDerainer(SOR(neighbours, deviations))(scan).any()
        return
    mean = mean_of_nearest(xyz, neighbours)
    limit = mean.mean() + deviations * mean.std(ddof=1)
    check(scan, SOR(neighbours, deviations), mean, np.full(len(mean), limit))


@given(cloud=clouds, neighbours=counts, growth=st.sampled_from([0.05, 0.4]))
def test_dsor_lets_the_limit_grow_with_range(cloud, neighbours, growth) -> None:
    scan = Scan.of(cloud)
    xyz, _, _ = positions(scan)
    if len(xyz) < 2:
        assert not FilterDerainer(DSOR(neighbours, 0.3, growth))(scan).any()
        return
    mean = mean_of_nearest(xyz, neighbours)
    limit = mean.mean() + 0.3 * mean.std(ddof=1)
    distance = np.linalg.norm(xyz.astype(np.float64), axis=1)
    check(scan, DSOR(neighbours, 0.3, growth), mean, limit * growth * distance)


@given(scattered, counts, st.sampled_from([0.0, 3.0, 40.0]))
def test_ssr_takes_the_norm_of_the_spectrum_of_a_neighbourhood(
    cloud, neighbours, threshold
) -> None:
    scan = Scan.of(np.abs(cloud))  # mirrored into one octant, where copies are rarer
    xyz, first, _ = positions(scan)
    distance = pairs(xyz)
    nearest = np.argsort(distance, axis=1, kind="stable")[:, :neighbours]
    tied = np.sort(distance, axis=1)
    if (np.diff(tied) == 0).any():
        return  # which of two equally near neighbours counts is not part of the definition
    intensity = scan.intensity[first].astype(np.float64)[nearest]
    near = np.take_along_axis(distance, nearest, axis=1)
    spectrum = np.fft.fft(intensity * (near + 1) ** 2, axis=1) if len(xyz) else np.zeros((0, 1))
    norm = np.linalg.norm(spectrum, axis=1)
    check(scan, SSR(neighbours, threshold), -norm, np.full(len(xyz), -threshold))


@given(cloud=clouds, neighbours=counts, spare=st.integers(0, 5))
def test_one_wide_view_serves_every_filter_as_its_own_does(cloud, neighbours, spare) -> None:
    scan = Scan.of(cloud)
    view = filter_view(neighbours + spare)(scan)
    for filter_ in (
        ROR(neighbours, 1.0),
        DROR(neighbours, azimuth_resolution=5.0),
        SOR(neighbours),
        DSOR(neighbours, range_multiplier=0.4),
        SSR(neighbours, threshold=30.0),
    ):
        shared = view.back(filter_.judge(view).astype(np.float32)) > 0
        np.testing.assert_array_equal(shared, FilterDerainer(filter_)(scan))


@pytest.mark.parametrize(
    "filter_",
    [ROR(3, 0.35), DROR(4, azimuth_resolution=1.0), DROR(azimuth_resolution=2.0, variant="paper")],
)
def test_points_settled_along_the_curve_are_settled_right(filter_) -> None:
    generator = np.random.default_rng(5)
    scan = Scan.of(generator.normal(size=(4000, 3)) * [10, 10, 0.1])
    view = filter_view(filter_.neighbours)(scan)
    lonely = filter_.judge(view)
    assert 0.05 < lonely.mean() < 0.95
    for rows in (np.arange(view.size), generator.permutation(view.size)):
        xyz = view.points[rows, :3]
        few = has_few_neighbours(xyz, filter_.radius_at(xyz), filter_.neighbours, threads=2)
        np.testing.assert_array_equal(few, lonely[rows])


def test_ror_and_sor_remove_what_open3d_removes(open3d) -> None:
    points = scene(2000)
    positions = open3d.utility.Vector3dVector(points[:, :3].astype(np.float64))
    cloud = open3d.geometry.PointCloud(positions)
    for filter_, (_, kept) in (
        (ROR(neighbours=4, radius=0.6), cloud.remove_radius_outlier(3, 0.6)),
        (SOR(5, 0.01), cloud.remove_statistical_outlier(5, 0.01)),
        (SOR(20, 1.0), cloud.remove_statistical_outlier(20, 1.0)),
    ):
        expected = ~np.isin(np.arange(len(points)), kept)
        assert 0.02 < expected.mean() < 0.95
        np.testing.assert_array_equal(FilterDerainer(filter_)(points), expected)
