"""Other points in the columns of a file."""

from pathlib import Path

import numpy as np
import pytest

from derain.files import read_scan, write_scan
from derain.files.columns import scan_of
from derain.scan import Scan
from derain.simulation.rewriting import with_intensity, with_points

ROWS = np.array([1, 4])
POINTS = np.array([[1.5, -2.0, 0.25], [10.0, 20.0, -2.0]])
OTHERS = np.array([0, 2, 3, 5])


def made_of(**columns: np.ndarray) -> Scan:
    return scan_of(Path("scan.npz"), columns)


@pytest.fixture
def coordinates() -> np.ndarray:
    return np.random.default_rng(0).uniform(1, 30, (6, 3))


def test_coordinates_are_written_in_the_columns_and_the_dtype_of_the_file(
    coordinates: np.ndarray,
) -> None:
    x, y, z = coordinates.T
    scan = made_of(X=x, y=y.astype(np.float32), z=np.rint(z).astype(np.int16))
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
    scan = made_of(xyz=coordinates, range=in_millimetres, distance=distance)
    moved = with_points(scan, ROWS, POINTS)
    expected = np.linalg.norm(POINTS, axis=1)
    assert moved.fields["range"][ROWS] == pytest.approx(1000 * expected, rel=1e-3)
    assert moved.fields["distance"][ROWS] == pytest.approx(expected, rel=1e-6)
    assert (moved.fields["range"][OTHERS] == in_millimetres[OTHERS]).all()


def test_what_is_not_a_number_is_zero_among_whole_numbers(coordinates: np.ndarray) -> None:
    scan = made_of(xyz=coordinates, range=np.full(6, 5, np.uint32))
    moved = with_points(scan, ROWS, np.full((2, 3), np.nan))
    assert np.isnan(moved.xyz[ROWS]).all()
    assert (moved.fields["range"][ROWS] == 0).all()


def test_intensities_are_rounded_to_what_the_column_holds(coordinates: np.ndarray) -> None:
    scan = made_of(xyz=coordinates, Reflectivity=np.arange(6, dtype=np.uint8))
    relit = with_intensity(scan, ROWS, np.array([12.6, 300.0]))
    assert relit.fields["Reflectivity"].tolist() == [0, 13, 2, 3, 255, 5]
    assert relit.intensity is not None
    assert relit.intensity.tolist() == [0, 13, 2, 3, 255, 5]


def test_only_the_intensity_that_is_read_is_rewritten(coordinates: np.ndarray) -> None:
    first, second = np.zeros(6, np.float32), np.zeros(6, np.float32)
    scan = made_of(xyz=coordinates, signal=first, intensity=second)
    relit = with_intensity(scan, ROWS, np.array([1.0, 2.0]))
    assert relit.fields["signal"].tolist() == [0] * 6
    assert relit.fields["intensity"].tolist() == [0, 1, 0, 0, 2, 0]


def test_the_scan_that_is_given_stays_as_it_is(coordinates: np.ndarray) -> None:
    scan = made_of(xyz=coordinates, intensity=np.arange(6.0))
    with_intensity(with_points(scan, ROWS, POINTS), ROWS, np.array([7.0, 8.0]))
    assert (scan.fields["xyz"] == coordinates).all()
    assert (scan.fields["intensity"] == np.arange(6)).all()


def test_a_scan_without_a_file_is_rewritten_too(coordinates: np.ndarray, tmp_path: Path) -> None:
    scan = Scan(coordinates.astype(np.float32), np.zeros(6, np.float32))
    relit = with_intensity(with_points(scan, ROWS, POINTS), ROWS, np.array([7.0, 8.0]))
    write_scan(tmp_path / "scan.bin", relit)
    again = read_scan(tmp_path / "scan.bin")
    assert (again.xyz == relit.xyz).all()
    assert again.intensity is not None
    assert again.intensity.tolist() == [0, 7, 0, 0, 8, 0]
