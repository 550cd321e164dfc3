"""Rain on recorded scans: what it does to their rows, on made and on real scans."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from derain.evaluation.hard_cases import hard_cases
from derain.files import read_scan
from derain.files.columns import scan_of
from derain.scan import Array, Bools, Scan
from derain.simulation.classes import TrackClass
from derain.simulation.rain import DROP_REFLECTIVITY, farthest_visible_drop
from derain.simulation.rain_field import UniformRain
from derain.simulation.recorded import rain_on_scan, with_intensity, with_points
from derain.simulation.sensor import Sensor
from derain.views.directions import directions

SENSOR = Sensor()
FILES = (
    "hesai_at128_front.pcd",
    "kitti_front.bin",
    "ouster_os0_32_dual.npz",
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


def equal(first: Array, second: Array) -> bool:
    """Whether two columns are the same, bit for bit."""
    floating = first.dtype.kind == "f"
    return first.dtype == second.dtype and np.array_equal(first, second, equal_nan=floating)


@pytest.fixture(scope="module", params=FILES)
def clear(request, shared) -> Scan:
    """Each of the clean scans."""
    return read_scan(shared / "data" / "clean" / request.param)


@pytest.fixture(scope="module")
def wet(clear) -> Scan:
    """The same scan in heavy rain, with the number that every row had."""
    return rained(numbered(clear), 50)


def test_clear_air_changes_nothing_of_a_real_scan(clear) -> None:
    same = rained(clear, 0)
    assert same.shape == clear.shape
    assert not is_rain(same).any()
    assert equal(same.xyz, clear.xyz)
    for name, column in clear.fields.items():
        assert equal(same.fields[name], column), name


def test_drops_on_a_real_scan_lie_on_its_beams_in_front_of_what_was_there(clear, wet) -> None:
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
    # None lies where the sensor does not look.
    seen = np.stack(directions(clear.xyz[clear.valid]), axis=1)
    at = np.stack(directions(wet.xyz[drops]), axis=1)
    assert (at > seen.min(axis=0) - HALF_A_PIXEL).all()
    assert (at < seen.max(axis=0) + HALF_A_PIXEL).all()


def test_what_rain_leaves_of_a_real_scan_stays_to_the_bit_and_in_order(clear, wet) -> None:
    kept = wet.take(wet.valid & ~is_rain(wet))
    number = kept.fields["number"]
    assert (np.diff(number) > 0).all()
    assert 0.5 * clear.valid.sum() < len(number) < clear.valid.sum()

    before = clear.take(number)
    assert equal(kept.xyz, before.xyz)
    for name, column in before.fields.items():
        if name not in ("intensity", "reflectivity"):
            assert equal(kept.fields[name], column), name
    if before.intensity is not None and kept.intensity is not None:
        assert (kept.intensity <= before.intensity).all()
        assert (kept.intensity < before.intensity).any()
    if clear.shape is None:
        appended = ~in_place(wet)
        assert is_rain(wet)[appended].all()
        assert appended.sum() > 100
    else:
        assert wet.shape == clear.shape
        assert (wet.fields["number"] == np.arange(len(clear))).all()
        assert (clear.valid | is_rain(wet) | ~wet.valid).all()


@pytest.mark.parametrize(("name", "scan"), list(hard_cases(1000)))
def test_hard_scans_stay_finite_where_they_were(name, scan) -> None:
    for rate in (0, 50):
        wet = rained(scan, rate)
        assert wet.valid[is_rain(wet)].all(), name
        # Invalid rows stay, and no others come.
        assert equal(wet.xyz[~wet.valid], scan.xyz[~scan.valid]), name
        assert (wet.intensity is None) == (scan.intensity is None)


def wall(
    distance: float,
    intensity: float,
    shape: tuple[int, int] | None = (40, 200),
    last: float | None = None,
) -> Scan:
    """A wall, whose last return may be of another brightness, so that intensities differ."""
    sensor = Sensor(rows=40, columns=200, azimuth=(-40, 40), inclination=(-10, 10))
    xyz = (sensor.beams() * distance).astype(np.float32)
    scan = Scan(xyz, np.full(len(xyz), intensity, np.float32), shape=shape)
    if last is not None:
        scan.intensity[-1] = last
    return scan


@pytest.mark.parametrize("shape", [None, (40, 200)])
@pytest.mark.parametrize("intensity", [0.0, 0.5, 100.0])
def test_drops_have_the_intensity_that_the_scan_has_throughout(intensity, shape) -> None:
    clear = wall(40.0, intensity, shape)
    # Sky, whose cells hold another intensity than the returns.
    sky = np.arange(len(clear)) % 3 == 0
    clear.xyz[sky], clear.intensity[sky] = (0, 0)
    wet = rained(clear if shape else clear.take(~sky), 50)
    assert is_rain(wet).sum() > 100
    assert (wet.intensity[wet.valid] == np.float32(intensity)).all()


def test_intensities_that_are_no_numbers_are_as_good_as_none() -> None:
    constant = wall(40.0, np.nan)
    wet, wet_without = rained(constant, 50), rained(replace(constant, intensity=None), 50)
    assert np.isnan(wet.intensity).all()
    assert equal(wet.xyz, wet_without.xyz)
    assert equal(wet.label, wet_without.label)


def test_the_column_of_the_file_holds_the_one_intensity_of_all_returns_but_a_radars() -> None:
    clear = wall(40.0, 7.0, shape=None)
    radar = np.arange(len(clear)) % 4 == 0
    clear.intensity[radar] = np.arange(radar.sum()) % 200
    column = clear.intensity.astype(np.uint8)
    wet = rained(replace(clear, radar=radar, fields={"reflectivity": column}), 50)
    assert is_rain(wet).sum() > 100
    assert (wet.intensity[~wet.radar] == 7).all()
    assert equal(wet.fields["reflectivity"], wet.intensity.astype(np.uint8))


def test_a_dark_return_is_lost_with_the_share_of_light_that_rain_takes() -> None:
    clear = wall(60.0, 0.0, None, last=255)
    sensor = Sensor(minimum_range=59.0, maximum_range=61.0)  # too far off to see a drop
    wet = rain_on_scan(clear, UniformRain(10), sensor, np.random.default_rng(1))
    share = np.exp(-2 * 1.556e-3 * 60)
    error = np.sqrt(share * (1 - share) / len(clear))
    assert len(wet) / len(clear) == pytest.approx(share, abs=4 * error)


def test_a_bright_return_is_kept_and_dimmed_by_the_light_that_rain_takes() -> None:
    clear = wall(40.0, 200.0, last=100)
    wet = rained(clear, 25)
    kept = ~is_rain(wet)
    kept[-1] = False
    assert wet.valid.all()
    assert kept.sum() > 0.8 * len(kept)
    assert wet.intensity[kept] == pytest.approx(200 * np.exp(-2 * 2.771e-3 * 40), rel=1e-3)


@pytest.mark.parametrize("full_scale", [1.0, 255.0, 65_535.0])
def test_drops_are_as_bright_as_water_on_the_scale_of_the_scan(full_scale) -> None:
    clear = wall(40.0, full_scale, last=full_scale / 2)
    wet = rained(clear, 50)
    drops = is_rain(wet)
    share = wet.intensity[drops] / full_scale
    assert 0.1 * DROP_REFLECTIVITY < share.mean() < DROP_REFLECTIVITY


@pytest.mark.parametrize(("gaps", "nothing"), [(0, np.nan), (1, np.nan), (1, 0.0)])
def test_a_lost_return_looks_like_an_empty_cell_or_is_not_a_number_and_labels_are_kept(
    gaps, nothing
) -> None:
    clear = wall(110.0, 0.0, last=255)
    clear.xyz[:gaps] = nothing
    wet = rained(clear.with_label(np.full(len(clear), 5)), 50)
    lost = wet.xyz[~wet.valid]
    assert len(lost) > 1000
    assert equal(lost, np.full_like(lost, nothing))
    assert set(wet.label[wet.valid]) == {5, TrackClass.RAIN}
    assert TrackClass.BACKGROUND in set(wet.label[~wet.valid]) <= {TrackClass.BACKGROUND, 5}


def test_points_of_a_radar_and_what_is_nearer_than_the_sensor_sees_stay() -> None:
    clear = wall(110.0, 0.0, None, last=255)
    radar = np.arange(len(clear)) % 2 == 0
    wet = rained(replace(clear, radar=radar), 50)
    assert len(wet) < len(clear)
    assert equal(wet.xyz[wet.radar], clear.xyz[radar])
    assert not wet.radar[is_rain(wet)].any()
    near = wall(0.5, 0.0, shape=None)
    assert equal(rained(near, 200).xyz[: len(near)], near.xyz)


ROWS, OTHERS = np.array([1, 4]), np.array([0, 2, 3, 5])
POINTS = np.array([[1.5, -2.0, 0.25], [10.0, 20.0, -2.0]])
COORDINATES = np.random.default_rng(0).uniform(1, 30, (6, 3))
COORDINATES[:, 2] = np.rint(COORDINATES[:, 2])


def from_parameters(**columns: np.ndarray) -> Scan:
    return scan_of(Path("scan.npz"), columns)


def test_coordinates_and_distances_are_written_in_the_columns_unit_and_dtype_of_the_file() -> None:
    x, y, z = COORDINATES.T
    distance = np.linalg.norm(COORDINATES, axis=1)
    millimetres = np.rint(1000 * distance).astype(np.uint32)
    given = {"X": x, "y": y.astype(np.float32), "z": z.astype(np.int16)}
    scan = from_parameters(**given, range=millimetres, distance=distance)
    moved = with_points(scan, ROWS, POINTS)
    assert (moved.xyz[ROWS] == POINTS.astype(np.float32)).all()
    expected = np.linalg.norm(POINTS, axis=1)
    written = {"X": POINTS[:, 0], "y": POINTS[:, 1], "z": [0, -2]}
    for name, values in (written | {"range": 1000 * expected, "distance": expected}).items():
        assert moved.fields[name].dtype == scan.fields[name].dtype
        assert moved.fields[name][ROWS] == pytest.approx(values, rel=1e-3)
        assert (moved.fields[name][OTHERS] == scan.fields[name][OTHERS]).all()
    nowhere = with_points(scan, ROWS, np.full((2, 3), np.nan))
    assert np.isnan(nowhere.xyz[ROWS]).all()
    assert (nowhere.fields["range"][ROWS] == 0).all()  # among whole numbers
    assert equal(scan.fields["distance"], distance)  # the scan that is given stays as it is


def test_intensities_are_rounded_to_what_the_column_that_is_read_holds() -> None:
    column, other = np.arange(6, dtype=np.uint8), np.zeros(6, np.float32)
    others = {"signal": other, "Intensity": other}
    scan = from_parameters(xyz=COORDINATES, **others, intensity=column)
    relit = with_intensity(scan, ROWS, np.array([12.6, 300.0]))
    assert relit.fields["intensity"].tolist() == [0, 13, 2, 3, 255, 5]
    assert relit.intensity.tolist() == [0, 13, 2, 3, 255, 5]
    assert not any(relit.fields[name].any() for name in others)
    assert equal(scan.fields["intensity"], np.arange(6, dtype=np.uint8))
