"""The fitted grid on sensors made here, whose beams are known, and on every real scan."""

import json

import numpy as np
import pytest

from derain.errors import InputError
from derain.evaluation.hard_cases import hard_cases
from derain.files import DEFAULT_COLUMNS, read_scan
from derain.scan import Floats, Scan
from derain.simulation.sensor import unit_vectors
from derain.views.grid_fit import PIXELS_PER_RETURN, fit_grid
from derain.views.spherical_grid import WADS_BEAMS, grid_of

HARD_CASES = dict(hard_cases())
BEAMS = np.array([9.0, 5.0, 3.2, 2.0, 1.1, 0.4, -0.3, -1.0, -2.1, -4.0, -7.5, -13.0])


def sensed(
    azimuth: Floats, inclination: Floats, keep: float = 0.8, bend: float = 0.0, seed: int = 0
) -> Scan:
    """Returns of beams by shots at random ranges, some shots without, in no order.

    Motion may bend the beams up and down by so many degrees.
    """
    rng = np.random.default_rng(seed)
    directions = np.stack(np.meshgrid(azimuth, inclination), axis=-1).reshape(-1, 2)
    directions = rng.permutation(directions)[: int(keep * len(directions))]
    directions[:, 1] += bend * np.sin(np.radians(2 * directions[:, 0]))
    return towards(directions, rng.uniform(2, 80, len(directions)))


def towards(directions: object, distance: object = 10.0) -> Scan:
    azimuth, inclination = np.asarray(directions).T
    xyz = unit_vectors(azimuth, inclination)
    return Scan((xyz * np.reshape(distance, (-1, 1))).astype(np.float32))


def together(*scans: Scan) -> Scan:
    return Scan(np.concatenate([scan.xyz for scan in scans]))


SPINNING = sensed(np.arange(-180, 180, 0.4), BEAMS)


def test_beams_and_steps_of_a_spinning_sensor_are_found() -> None:
    fit = fit_grid([SPINNING])
    np.testing.assert_allclose(fit.beams, BEAMS, atol=1e-4)
    assert fit.grid.is_full_circle
    assert (fit.grid.rows, fit.grid.columns) == (12, 960)  # 900 shots
    assert (fit.hidden, fit.outside) == (0, 0)
    assert fit.empty == pytest.approx(1 - 0.8 * 900 / 960)


def test_more_scans_of_the_sensor_give_the_same_grid() -> None:
    turned = [
        sensed(np.arange(-180, 180, 0.4) + 0.07 * turn, BEAMS, seed=turn) for turn in range(9)
    ]
    empty = Scan(np.zeros((0, 3), np.float32))
    grid, expected = fit_grid([*turned, empty]).grid, fit_grid([SPINNING]).grid
    assert (grid.columns, grid.azimuth) == (expected.columns, expected.azimuth)
    np.testing.assert_allclose(grid.edges, expected.edges, atol=1e-4)


def test_duplicates_hide_nothing_and_are_worth_no_further_pixels() -> None:
    fit = fit_grid([together(SPINNING, SPINNING)])
    assert fit.grid == fit_grid([SPINNING]).grid
    assert fit.hidden == 0
    assert fit.points == 2 * len(SPINNING)


def test_second_returns_behind_the_first_are_counted_as_hidden() -> None:
    behind = Scan(SPINNING.xyz[:500] * np.float32(2))
    fit = fit_grid([together(SPINNING, behind)])
    assert fit.hidden == pytest.approx(500 / fit.points)


@pytest.mark.parametrize("ahead", [0, 90, 180, -120])
def test_a_sensor_that_looks_one_way_gets_a_grid_that_does(ahead) -> None:
    fit = fit_grid([sensed(ahead + np.linspace(-50, 50, 501), BEAMS)])
    right, left = fit.grid.azimuth
    assert not fit.grid.is_full_circle
    assert fit.grid.columns == 512  # 501 shots
    assert left - right == pytest.approx(100.2, abs=0.01)
    assert ((right + left) / 2 - ahead + 180) % 360 == pytest.approx(180, abs=0.01)
    assert (fit.hidden, fit.outside) == (0, 0)


def test_a_sector_of_less_than_30_degrees_without_returns_leaves_the_circle_closed() -> None:
    assert fit_grid([sensed(np.arange(-166, 166, 0.4), BEAMS)]).grid.is_full_circle
    assert not fit_grid([sensed(np.arange(-164, 164, 0.4), BEAMS)]).grid.is_full_circle


def test_bent_beams_give_even_rows_of_their_step() -> None:
    beams = np.linspace(-20, 4, 61)  # 0.4 degrees apart
    fit = fit_grid([sensed(np.arange(-180, 180, 0.4), beams, bend=0.3)])
    assert fit.beams == ()
    assert (fit.grid.rows, fit.grid.columns) == (64, 960)
    heights = -np.diff(fit.grid.edges)[1:-1]
    np.testing.assert_allclose(heights, heights[0])
    assert fit.outside == 0


def test_outliers_get_no_rows_but_are_on_the_grid() -> None:
    beams = np.linspace(-20, 4, 61)
    scan = sensed(np.arange(-180, 180, 0.4), beams, bend=0.3)
    plain = fit_grid([scan])
    odd = fit_grid([together(scan, towards([(5, 70), (100, 71), (-30, -60)]))])
    assert odd.grid.rows == plain.grid.rows
    np.testing.assert_allclose(odd.grid.edges[1:-1], plain.grid.edges[1:-1], atol=0.01)
    assert (odd.grid.edges[-1], odd.grid.edges[0]) == pytest.approx((-60, 71))
    assert odd.outside == 0


def test_outliers_among_beams_are_no_beams_but_are_on_the_grid() -> None:
    rng = np.random.default_rng(1)
    stray = np.stack([rng.uniform(-180, 180, 40), rng.uniform(-40, 40, 40)], axis=1)
    fit = fit_grid([together(SPINNING, towards(stray))])
    np.testing.assert_allclose(fit.beams, BEAMS, atol=1e-4)
    assert fit.outside == 0


def test_outliers_behind_a_sensor_that_looks_ahead_stay_outside() -> None:
    front = sensed(np.linspace(-50, 50, 2001), BEAMS)
    odd = fit_grid([together(front, towards([(180, 0), (-100, 1), (120, 2)]))])
    plain = fit_grid([front])
    assert (odd.grid.rows, odd.grid.columns) == (plain.grid.rows, plain.grid.columns)
    assert odd.grid.azimuth == pytest.approx(plain.grid.azimuth)
    assert odd.outside == pytest.approx(3 / odd.points)


def organised(inclination: Floats, blur: float) -> Scan:
    rng = np.random.default_rng(3)
    azimuth = np.arange(180, -180, -0.5)
    grid = np.stack(np.meshgrid(azimuth, inclination), axis=-1)
    grid[..., 1] += rng.uniform(-blur, blur, grid.shape[:2])
    scan = towards(grid.reshape(-1, 2), rng.uniform(2, 80, grid.size // 2))
    scan.xyz[rng.random(len(scan)) < 0.2] = np.nan
    return Scan(scan.xyz, shape=(len(inclination), len(azimuth)))


@pytest.mark.parametrize("descending", [True, False])
def test_rows_of_an_organised_scan_are_beams_where_inclination_separates_them(descending) -> None:
    # Beams that touch: by inclination alone there is one cluster.
    beams = np.cumsum(np.linspace(1, 0.2, 30)) - 12
    scan = organised(beams[::-1] if descending else beams, blur=0.1)
    fit = fit_grid([scan])
    np.testing.assert_allclose(fit.beams, beams[::-1], atol=0.02)
    assert (fit.grid.rows, fit.grid.columns) == (30, 768)  # 720 shots
    assert fit_grid([Scan(scan.xyz)]).beams == ()


def test_rows_of_an_organised_scan_that_are_not_beams_are_not_taken_for_them() -> None:
    beams = np.linspace(-10, 10, 32)
    scan = organised(beams, blur=0.1)
    by_column = scan.xyz.reshape(32, -1, 3).swapaxes(0, 1).reshape(-1, 3)
    assert fit_grid([Scan(by_column, shape=(720, 32))]).beams == ()


def test_shares_are_those_counted_by_hand() -> None:
    rng = np.random.default_rng(4)
    scans = [Scan.of(rng.normal(size=(400, 3)) * [9, 9, 1] + [9, 0, 0]) for _ in range(3)]
    fit = fit_grid(scans)
    hidden = outside = filled = 0
    for scan in scans:
        pixel = fit.grid.pixel(scan.xyz)
        nearest = {number: scan.range[pixel == number].min() for number in set(pixel) - {-1}}
        outside += int((pixel < 0).sum())
        filled += len(nearest)
        hidden += sum(r > nearest.get(p, np.inf) for p, r in zip(pixel, scan.range, strict=True))
    assert fit.points == 1200
    assert (fit.hidden, fit.outside) == (hidden / 1200, outside / 1200)
    assert fit.empty == pytest.approx(1 - filled / (3 * fit.grid.rows * fit.grid.columns))


@pytest.mark.parametrize("scans", [[], [HARD_CASES["empty"]], [HARD_CASES["nothing valid"]]])
def test_scans_without_a_valid_point_are_refused(scans) -> None:
    with pytest.raises(InputError, match="no valid point"):
        fit_grid(scans)


@pytest.mark.parametrize("case", [name for name, scan in HARD_CASES.items() if scan.valid.any()])
def test_hard_cases_get_a_grid_of_bounded_size_that_holds_them(case) -> None:
    scan = HARD_CASES[case]
    fit = fit_grid([scan])
    assert fit.outside < 0.01
    assert fit.grid.columns % 64 == 0
    assert fit.grid.rows == len(fit.beams) or fit.grid.rows % 16 == 0
    bound = PIXELS_PER_RETURN * scan.valid.sum() + 16 * fit.grid.columns
    assert fit.grid.rows * fit.grid.columns <= bound


def test_a_fit_can_be_printed_and_its_grid_written_into_a_configuration() -> None:
    fit = fit_grid([SPINNING])
    content = json.loads(json.dumps(fit.as_dict()))
    assert (content["rows"], content["columns"], content["beams"]) == (12, 960, 12)
    assert content["azimuth"] == [-180, 180]
    assert grid_of(content["grid"], "config.yaml") == fit.grid
    bent = fit_grid([sensed(np.arange(-180, 180, 0.4), BEAMS, bend=0.3)])
    assert bent.as_dict()["beams"] == "not found"


RADAR = ("x", "y", "z", *(f"column {number}" for number in range(3, 10)))


@pytest.mark.parametrize(
    ("name", "rows", "columns", "beams", "azimuth", "hidden", "empty"),
    [
        ("wads/sample.bin", 64, 1856, 64, None, 0.13, 0.15),
        ("wads/sequences/36/velodyne/042223.bin", 64, 1856, 64, None, 0.09, 0.13),
        ("snowykitti/velodyne/000000.bin", 64, 2048, 0, None, 0.11, 0.34),
        ("clean/kitti_hdl64.bin", 80, 2048, 0, None, 0.14, 0.35),
        ("clean/kitti_front.bin", 64, 448, 0, (-40.4, 39.5), 0.12, 0.47),
        ("clean/pandaset_pandar64.pcd", 63, 1856, 63, None, 0.02, 0.35),
        ("clean/ouster_os1_128.npz", 128, 1024, 128, None, 0.01, 0.19),
        ("clean/ouster_os0_32_dual.npz", 32, 1024, 32, None, 0.001, 0.35),
        ("clean/hesai_at128_front.pcd", 32, 640, 0, (-58.5, 60.0), 0.29, 0.65),
        ("clean/velodyne_vlp16_dual.pcd", 15, 1856, 15, None, 0.12, 0.54),
        ("radar/ars548_detections.npy", 16, 192, 0, (-54.9, 56.5), 0.32, 0.94),
    ],
)
def test_real_sensors_get_the_grid_of_their_beams_and_shots(
    shared, name, rows, columns, beams, azimuth, hidden, empty
) -> None:
    scan = read_scan(shared / "data" / name, RADAR if name.endswith(".npy") else DEFAULT_COLUMNS)
    fit = fit_grid([scan])
    assert (fit.grid.rows, fit.grid.columns, len(fit.beams)) == (rows, columns, beams)
    assert fit.grid.azimuth == (pytest.approx(azimuth, abs=0.1) if azimuth else (-180, 180))
    assert fit.outside == 0
    assert fit.hidden <= hidden
    assert fit.empty <= empty


def test_the_beams_of_wads_are_those_of_its_raw_scans(shared) -> None:
    files = sorted((shared / "data/wads/sequences/36/velodyne").glob("*.bin"))
    fit = fit_grid([read_scan(file) for file in files])
    assert len(files) == 10
    assert [round(beam, 3) for beam in fit.beams] == WADS_BEAMS
    assert fit.grid.columns == 1856
    assert fit.outside == 0
