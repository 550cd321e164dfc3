"""Rain on recorded scans: what it does to their rows, on made and on real scans."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from derain.evaluation.hard_cases import hard_cases
from derain.files import read_scan, write_scan
from derain.files.columns import scan_of
from derain.scan import Scan
from derain.simulation.arrays import Bools
from derain.simulation.classes import TrackClass
from derain.simulation.rain import DROP_REFLECTIVITY, farthest_visible_drop
from derain.simulation.rain_field import SprinkledRain, UniformRain
from derain.simulation.recorded import rain_on_scan, with_intensity, with_points
from derain.simulation.sensor import Sensor
from derain.views.directions import directions

SENSOR = Sensor()
FILES = (
    "hesai_at128_front.pcd",
    "kitti_front.bin",
    "kitti_hdl64.bin",
    "ouster_os0_32_dual.npz",
    "ouster_os1_128.npz",
    "pandaset_pandar64.pcd",
    "velodyne_vlp16_dual.pcd",
)
# Half a pixel of a grid that is fitted to one of these scans is less, degrees.
HALF_A_PIXEL = 0.5
# Beyond this a measured distance is off in one of a million drops.
NOISE = 6 * SENSOR.range_noise


def rained(scan: Scan, rate: float, seed: int = 0) -> Scan:
    return rain_on_scan(scan, UniformRain(rate), SENSOR, np.random.default_rng(seed))


def is_rain(scan: Scan) -> Bools:
    return scan.label == TrackClass.RAIN


def numbered(scan: Scan) -> Scan:
    """The scan with the number of every row in a column, which follows the row."""
    return replace(scan, fields={**scan.fields, "number": np.arange(len(scan))})


def in_place(wet: Scan) -> Bools:
    """True for rows in the order that they had, as far as it goes: appended ones follow."""
    return np.append(True, np.diff(wet.fields["number"]) > 0).cumprod().astype(bool)


def equal(first: NDArray[Any], second: NDArray[Any]) -> bool:
    """Whether two columns are the same, bit for bit."""
    floating = first.dtype.kind == "f"
    return first.dtype == second.dtype and np.array_equal(first, second, equal_nan=floating)


@pytest.fixture(scope="module", params=FILES)
def clear(request: pytest.FixtureRequest, shared: Path) -> Scan:
    """Each of the clean scans."""
    return read_scan(shared / "data" / "clean" / request.param)


@pytest.fixture(scope="module")
def wet(clear: Scan) -> Scan:
    """The same scan in heavy rain, with the number that every row had."""
    return rained(numbered(clear), 50)


def test_clear_air_changes_nothing_of_a_real_scan(clear: Scan) -> None:
    same = rained(clear, 0)
    assert same.shape == clear.shape
    assert not is_rain(same).any()
    assert equal(same.xyz, clear.xyz)
    for name, column in clear.fields.items():
        assert equal(same.fields[name], column), name


def test_drops_on_a_real_scan_lie_on_its_beams_in_front_of_what_was_there(
    clear: Scan, wet: Scan
) -> None:
    drops = is_rain(wet)
    assert drops.sum() > 0.02 * len(drops)
    assert wet.valid[drops].all()
    assert (wet.range[drops] < farthest_visible_drop(SENSOR) + NOISE).all()

    number = wet.fields["number"]
    replaced = drops & in_place(wet) & clear.valid[number]
    assert 0 < replaced.sum() < drops.sum()  # some are on beams that had returned nothing
    before, after = clear.take(number[replaced]), wet.take(replaced)
    assert (after.range < before.range + NOISE).all()
    cosine = (after.xyz * before.xyz).sum(axis=1) / (after.range * before.range)
    assert cosine == pytest.approx(1, abs=1e-5)


def test_no_drop_lies_where_a_real_sensor_does_not_look(clear: Scan, wet: Scan) -> None:
    seen = np.stack(directions(clear.xyz[clear.valid]), axis=1)
    drops = np.stack(directions(wet.xyz[is_rain(wet)]), axis=1)
    assert (drops > seen.min(axis=0) - HALF_A_PIXEL).all()
    assert (drops < seen.max(axis=0) + HALF_A_PIXEL).all()


def test_what_rain_leaves_of_a_real_scan_stays_to_the_bit_and_in_order(
    clear: Scan, wet: Scan
) -> None:
    kept = wet.take(wet.valid & ~is_rain(wet))
    number = kept.fields["number"]
    assert (np.diff(number) > 0).all()
    assert len(number) > 0.5 * clear.valid.sum()

    before = clear.take(number)
    assert equal(kept.xyz, before.xyz)
    for name, column in before.fields.items():
        if name not in ("intensity", "reflectivity"):
            assert equal(kept.fields[name], column), name
    if before.intensity is not None and kept.intensity is not None:
        assert (kept.intensity <= before.intensity).all()
        assert (kept.intensity < before.intensity).any()


def test_every_row_of_a_real_scan_is_kept_or_gives_way_to_a_drop_or_is_lost(
    clear: Scan, wet: Scan
) -> None:
    number = wet.fields["number"]
    if clear.shape is not None:
        assert wet.shape == clear.shape
        assert (number == np.arange(len(clear))).all()
        assert (clear.valid | is_rain(wet) | ~wet.valid).all()
        return
    appended = ~in_place(wet)
    assert is_rain(wet)[appended].all()
    assert appended.sum() > 100


def test_more_rain_leaves_less_of_a_real_scan(clear: Scan, wet: Scan) -> None:
    kept = [np.count_nonzero(~is_rain(scan) & scan.valid) for scan in (rained(clear, 10), wet)]
    less, more = clear.valid.sum() - np.array(kept)
    assert less >= 0
    assert more > 0
    assert more >= less - 4 * np.sqrt(less)


def test_a_rained_real_scan_can_be_written_in_its_own_format(clear: Scan, tmp_path: Path) -> None:
    wet = rained(clear, 25)
    path = tmp_path / Path(clear.name).name
    write_scan(path, wet)
    again = read_scan(path)
    assert equal(again.xyz, wet.xyz)
    assert again.shape == wet.shape
    for name, column in wet.fields.items():
        assert equal(again.fields[name], column), name


@pytest.mark.parametrize(("name", "scan"), list(hard_cases(1000)))
def test_hard_scans_stay_finite_where_they_were(name: str, scan: Scan) -> None:
    for rain in (UniformRain(0), UniformRain(50), SprinkledRain(50)):
        wet = rain_on_scan(scan, rain, SENSOR, np.random.default_rng(0))
        assert wet.valid[is_rain(wet)].all(), name
        # Invalid rows stay, and no others come.
        assert equal(wet.xyz[~wet.valid], scan.xyz[~scan.valid]), name
        assert (wet.intensity is None) == (scan.intensity is None)


def wall(distance: float, intensity: float, shape: tuple[int, int] | None = (40, 200)) -> Scan:
    sensor = Sensor(rows=40, columns=200, azimuth=(-40, 40), inclination=(-10, 10))
    xyz = (sensor.beams() * distance).astype(np.float32)
    return Scan(xyz, np.full(len(xyz), intensity, np.float32), shape=shape)


def uneven_wall(
    distance: float, intensity: float, shape: tuple[int, int] | None = (40, 200)
) -> Scan:
    """A wall whose first return is of another brightness, so that intensity tells something."""
    scan = wall(distance, intensity, shape)
    scan.intensity[0] = intensity / 2 if intensity else 255
    return scan


def distinguishable(first: NDArray[Any], second: NDArray[Any]) -> bool:
    """Whether any rule on a number tells two samples of it apart, better than chance."""
    values = np.union1d(first, second)
    return any((first == value).mean() != (second == value).mean() for value in values)


@pytest.mark.parametrize("shape", [None, (40, 200)])
@pytest.mark.parametrize("intensity", [0.0, 0.5, 100.0])
def test_no_rule_on_intensity_finds_drops_where_the_scan_has_one_throughout(
    intensity: float, shape: tuple[int, int] | None
) -> None:
    clear = wall(40.0, intensity, shape)
    # Sky, whose cells hold another intensity than the returns.
    sky = np.arange(len(clear)) % 3 == 0
    clear.xyz[sky], clear.intensity[sky] = (0, 0)
    wet = rained(clear if shape else clear.take(~sky), 50)
    drops = is_rain(wet)
    solid = wet.valid & ~drops
    assert min(drops.sum(), solid.sum()) > 100
    assert not distinguishable(wet.intensity[drops], wet.intensity[solid])
    assert (wet.intensity[solid] == np.float32(intensity)).all()


@pytest.mark.parametrize("intensity", [0.0, np.nan])
def test_one_intensity_throughout_is_as_good_as_none_and_drops_get_it(intensity: float) -> None:
    constant = wall(40.0, intensity)
    wet, wet_without = rained(constant, 50), rained(replace(constant, intensity=None), 50)
    assert is_rain(wet).sum() > 100
    assert np.array_equal(wet.intensity[wet.valid], np.full(wet.valid.sum(), intensity), True)
    assert wet_without.intensity is None
    assert equal(wet.xyz, wet_without.xyz)
    assert equal(wet.label, wet_without.label)


def test_what_a_radar_measured_is_no_intensity_of_the_lidar() -> None:
    clear = wall(40.0, 0.0, shape=None)
    radar = np.arange(len(clear)) % 4 == 0
    clear.intensity[radar] = np.arange(radar.sum())
    wet = rained(replace(clear, radar=radar), 50)
    assert is_rain(wet).sum() > 100
    assert not wet.intensity[is_rain(wet)].any()


def test_the_column_of_the_file_holds_the_one_intensity_of_all_returns_as_well() -> None:
    clear = wall(40.0, 7.0, shape=None)
    column = np.full(len(clear), 7, np.uint8)
    wet = rained(replace(clear, fields={"reflectivity": column}), 50)
    assert equal(wet.fields["reflectivity"], np.full(len(wet), 7, np.uint8))


def test_a_dark_return_is_lost_with_the_share_of_light_that_rain_takes() -> None:
    clear = uneven_wall(60.0, 0.0, shape=None)
    sensor = Sensor(minimum_range=59.0, maximum_range=61.0)  # too far off to see a drop
    wet = rain_on_scan(clear, UniformRain(10), sensor, np.random.default_rng(1))
    share = np.exp(-2 * 1.556e-3 * 60)
    error = np.sqrt(share * (1 - share) / len(clear))
    assert len(wet) / len(clear) == pytest.approx(share, abs=4 * error)


def test_a_bright_return_is_kept_and_dimmed_by_the_light_that_rain_takes() -> None:
    clear = uneven_wall(40.0, 200.0)
    wet = rained(clear, 25)
    kept = ~is_rain(wet)
    kept[0] = False
    assert wet.valid.all()
    assert kept.sum() > 0.8 * len(kept)
    assert wet.intensity[kept] == pytest.approx(200 * np.exp(-2 * 2.771e-3 * 40), rel=1e-3)


@pytest.mark.parametrize("full_scale", [1.0, 255.0, 65_535.0])
def test_drops_are_as_bright_as_water_on_the_scale_of_the_scan(full_scale: float) -> None:
    clear = uneven_wall(40.0, full_scale)
    wet = rained(clear, 50)
    drops = is_rain(wet)
    share = wet.intensity[drops] / full_scale
    assert 0.1 * DROP_REFLECTIVITY < share.mean() < DROP_REFLECTIVITY


@pytest.mark.parametrize(("gaps", "nothing"), [(0, np.nan), (1, np.nan), (1, 0.0)])
def test_a_lost_return_looks_like_an_empty_cell_or_is_not_a_number(
    gaps: int, nothing: float
) -> None:
    clear = uneven_wall(110.0, 0.0)
    clear.xyz[:gaps] = nothing
    wet = rained(clear, 50)
    lost = wet.xyz[~wet.valid]
    assert len(lost) > 1000
    assert equal(lost, np.full_like(lost, nothing))


def test_labels_are_kept_where_nothing_happens() -> None:
    clear = uneven_wall(110.0, 0.0)
    wet = rained(clear.with_label(np.full(len(clear), 5)), 50)
    assert set(wet.label[wet.valid]) == {5, TrackClass.RAIN}
    assert set(wet.label[~wet.valid]) == {TrackClass.BACKGROUND}


def test_points_of_a_radar_stay_and_no_drop_is_one() -> None:
    clear = uneven_wall(110.0, 0.0, shape=None)
    radar = np.arange(len(clear)) % 2 == 0
    wet = rained(replace(clear, radar=radar), 50)
    assert len(wet) < len(clear)
    assert equal(wet.xyz[wet.radar], clear.xyz[radar])
    assert not wet.radar[is_rain(wet)].any()


def test_what_is_nearer_than_the_sensor_sees_stays() -> None:
    near = wall(0.5, 0.0, shape=None)
    assert equal(rained(near, 200).xyz[: len(near)], near.xyz)


def test_a_seed_gives_the_same_rain_again() -> None:
    clear = wall(40.0, 100.0)
    first, again, other = (rained(clear, 50, seed) for seed in (1, 1, 2))
    assert np.array_equal(first.xyz, again.xyz)
    assert np.array_equal(first.intensity, again.intensity)
    assert not np.array_equal(first.xyz, other.xyz)


def test_rain_falls_only_where_the_field_has_any() -> None:
    clear = wall(100.0, 255.0)
    here, elsewhere = (
        rain_on_scan(clear, SprinkledRain(50, (0.0, drift)), SENSOR, np.random.default_rng(0))
        for drift in (0.0, 1000.0)
    )
    assert is_rain(here).sum() > 100
    assert not is_rain(elsewhere).any()


ROWS = np.array([1, 4])
POINTS = np.array([[1.5, -2.0, 0.25], [10.0, 20.0, -2.0]])
OTHERS = np.array([0, 2, 3, 5])


def from_parameters(**columns: np.ndarray) -> Scan:
    return scan_of(Path("scan.npz"), columns)


@pytest.fixture
def coordinates() -> np.ndarray:
    return np.random.default_rng(0).uniform(1, 30, (6, 3))


def test_coordinates_are_written_in_the_columns_and_the_dtype_of_the_file(
    coordinates: np.ndarray,
) -> None:
    x, y, z = coordinates.T
    scan = from_parameters(X=x, y=y.astype(np.float32), z=np.rint(z).astype(np.int16))
    moved = with_points(scan, ROWS, POINTS)
    assert {name: column.dtype for name, column in moved.fields.items()} == {
        name: column.dtype for name, column in scan.fields.items()
    }
    assert (moved.fields["X"][ROWS] == POINTS[:, 0]).all()
    assert (moved.fields["z"][ROWS] == [0, -2]).all()
    assert (moved.xyz[ROWS] == POINTS.astype(np.float32)).all()
    for name in scan.fields:
        assert (moved.fields[name][OTHERS] == scan.fields[name][OTHERS]).all()
    assert (moved.xyz[OTHERS] == scan.xyz[OTHERS]).all()


def test_distances_keep_their_unit(coordinates: np.ndarray) -> None:
    distance = np.linalg.norm(coordinates, axis=1)
    in_millimetres = np.rint(1000 * distance).astype(np.uint32)
    scan = from_parameters(xyz=coordinates, range=in_millimetres, distance=distance)
    moved = with_points(scan, ROWS, POINTS)
    expected = np.linalg.norm(POINTS, axis=1)
    assert moved.fields["range"][ROWS] == pytest.approx(1000 * expected, rel=1e-3)
    assert moved.fields["distance"][ROWS] == pytest.approx(expected, rel=1e-6)
    assert (moved.fields["range"][OTHERS] == in_millimetres[OTHERS]).all()


def test_what_is_not_a_number_is_zero_among_whole_numbers(coordinates: np.ndarray) -> None:
    scan = from_parameters(xyz=coordinates, range=np.full(6, 5, np.uint32))
    moved = with_points(scan, ROWS, np.full((2, 3), np.nan))
    assert np.isnan(moved.xyz[ROWS]).all()
    assert (moved.fields["range"][ROWS] == 0).all()


def test_intensities_are_rounded_to_what_the_column_holds(coordinates: np.ndarray) -> None:
    scan = from_parameters(xyz=coordinates, Reflectivity=np.arange(6, dtype=np.uint8))
    relit = with_intensity(scan, ROWS, np.array([12.6, 300.0]))
    assert relit.fields["Reflectivity"].tolist() == [0, 13, 2, 3, 255, 5]
    assert relit.intensity.tolist() == [0, 13, 2, 3, 255, 5]


def test_only_the_intensity_that_is_read_is_rewritten(coordinates: np.ndarray) -> None:
    first, second = np.zeros(6, np.float32), np.zeros(6, np.float32)
    scan = from_parameters(xyz=coordinates, signal=first, intensity=second)
    relit = with_intensity(scan, ROWS, np.array([1.0, 2.0]))
    assert relit.fields["signal"].tolist() == [0] * 6
    assert relit.fields["intensity"].tolist() == [0, 1, 0, 0, 2, 0]


def test_the_scan_that_is_given_stays_as_it_is(coordinates: np.ndarray) -> None:
    scan = from_parameters(xyz=coordinates, intensity=np.arange(6.0))
    with_intensity(with_points(scan, ROWS, POINTS), ROWS, np.array([7.0, 8.0]))
    assert (scan.fields["xyz"] == coordinates).all()
    assert (scan.fields["intensity"] == np.arange(6)).all()
