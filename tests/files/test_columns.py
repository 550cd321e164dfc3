"""A further column stands beside those that a scan has, also beside those of one from no file."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.files import read_scan, write_scan
from derain.files.columns import with_column
from derain.scan import Scan


def test_a_column_of_the_same_name_is_replaced_in_its_place() -> None:
    points = scene(10)
    fields = dict(zip(("x", "ring", "y", "z"), points.T[[0, 3, 1, 2]], strict=True))
    scan = with_column(replace(Scan.of(points), fields=fields), "ring", np.arange(10))
    assert list(scan.fields) == ["x", "ring", "y", "z"]
    np.testing.assert_array_equal(scan.fields["ring"], np.arange(10))


def test_of_names_in_two_cases_the_lower_one_counts(tmp_path) -> None:
    names = ("X", "y", "z", "x", "i", "Intensity", "intensity")
    scan = read_scan(written(tmp_path / "scan.csv", names))
    assert scan.xyz[0].tolist() == [4, 2, 3]
    assert scan.intensity[0] == 7


@pytest.mark.parametrize(
    "names", [("x", "y", "z", "Intensity", "INTENSITY"), ("x", "y", "z", "Radar", "RADAR")]
)
def test_two_columns_that_differ_in_case_alone_are_refused(tmp_path, names) -> None:
    path = written(tmp_path / "scan.csv", names)
    with pytest.raises(InputError, match=f"{names[3]} and {names[4]}") as refused:
        read_scan(path)
    assert str(path) in str(refused.value)


@pytest.mark.parametrize(
    ("suffix", "name", "column"),
    [
        *((suffix, name, np.zeros(5)) for suffix in (".pcd", ".ply") for name in ("a b", "")),
        *((".pcd", "it", np.zeros(5, kind)) for kind in (np.float16, np.complex64, "U3")),
        (".pcd", "nothing", np.zeros((5, 0))),
        (".ply", "it", np.zeros((5, 3))),
        (".ply", "it", np.zeros(5, np.int64)),
        *((".csv", name, np.ones(5)) for name in ("#comment", " padded", "two\nlines")),
        (".csv", "it", np.ones(5, np.complex64)),
        (".csv", "it", np.ones((5, 3))),
        (".feather", "it", np.ones((5, 3))),
    ],
)
def test_a_column_that_a_format_cannot_hold_is_refused(
    tmp_path, scan, suffix, name, column
) -> None:
    path = tmp_path / f"scan{suffix}"
    with pytest.raises(InputError, match=rf"\{suffix} has no place for the column '"):
        write_scan(path, replace(scan, fields={**scan.fields, name: column}))
    assert not path.exists()


@pytest.mark.parametrize("suffix", [".csv", ".ply", ".pcd", ".npz", ".feather"])
def test_a_file_without_coordinates_is_refused(tmp_path, suffix) -> None:
    path = written(tmp_path / f"scan{suffix}", ("x", "y", "depth", "ring"))
    with pytest.raises(InputError, match=r"no coordinates|no x, y and z .* \(x .*, depth .*\)"):
        read_scan(path)


@pytest.mark.parametrize(
    ("columns", "kinds"),
    [
        ({axis: np.zeros(5, np.complex64) for axis in "xyz"}, ["x complex64", "z complex64"]),
        ({"x": np.zeros(5), "y": np.zeros(5), "Z": np.zeros(5, bool)}, ["Z bool"]),
        ({"x": np.zeros(5), "y": np.zeros(5), "z": np.zeros((5, 3))}, ["float64", "(3,)"]),
        ({"xyz": np.zeros((5, 3), "U1")}, ["xyz", "U1"]),
        ({"points": np.zeros((5, 3), "U1")}, ["x <U1", "y <U1", "z <U1"]),
    ],
)
def test_coordinates_that_are_no_numbers_are_named_with_what_they_are(
    tmp_path, columns, kinds
) -> None:
    np.savez(tmp_path / "scan.npz", **columns)
    with pytest.raises(InputError) as refused:
        read_scan(tmp_path / "scan.npz", ("x", "y", "z"))
    assert all(part in refused.value.reason for part in kinds)


def test_truth_values_tell_which_points_are_of_the_radar(tmp_path) -> None:
    radar = np.array([True, False, True])
    np.savez(tmp_path / "scan.npz", xyz=np.ones((3, 3)), radar=radar)
    np.testing.assert_array_equal(read_scan(tmp_path / "scan.npz").radar, radar)


def test_a_field_of_one_value_in_brackets_is_a_column(tmp_path) -> None:
    points = np.ones(3, [(name, "f4", (1,)) for name in ("x", "y", "z", "intensity", "doppler")])
    points["intensity"] = points["doppler"] = [[1], [2], [3]]
    np.save(tmp_path / "scan.npy", points)
    np.savez(tmp_path / "scan.npz", points)
    for suffix in (".npy", ".npz"):
        scan = read_scan(tmp_path / f"scan{suffix}")
        assert scan.intensity.tolist() == scan.channel("doppler").tolist() == [1, 2, 3]
        write_scan(tmp_path / f"copy{suffix}", scan)
    assert (tmp_path / "copy.npy").read_bytes() == (tmp_path / "scan.npy").read_bytes()
    assert np.load(tmp_path / "copy.npz")["arr_0"].dtype == points.dtype


def written(path: Path, names: tuple[str, ...]) -> Path:
    """A file of ten points, whose first holds the place of each column, from 1."""
    rows = np.arange(1, len(names) + 1, dtype=np.float32) + np.arange(10, dtype=np.float32)[:, None]
    fields = dict(zip(names, rows.T.copy(), strict=True))
    write_scan(path, Scan(rows[:, :3].copy(), fields=fields))
    return path
