"""NumPy's own files."""

import pickle
import re
import zipfile
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from derain import InputError
from derain.files import read_scan, write_scan

HEIGHT, WIDTH = 4, 6


def test_organised_arrays_are_flattened_row_by_row_and_come_back_as_they_were(
    tmp_path,
) -> None:
    # Of a spinning sensor with 4 beams and 6 columns.
    generator = np.random.default_rng(1)
    organised = {
        "xyz": generator.normal(0, 9, (HEIGHT, WIDTH, 3)).astype(np.float32),
        "signal": generator.integers(0, 9000, (HEIGHT, WIDTH), np.uint16),
        "reflectivity": generator.integers(0, 255, (HEIGHT, WIDTH), np.uint8),
        "timestamp": np.arange(WIDTH, dtype=np.uint64) + 2**63,
        "beam_angles": np.linspace(-20, 20, HEIGHT),
        "file": np.array("made by hand"),
    }
    with zipfile.ZipFile(tmp_path / "scan.npz", "w") as archive:
        for name, array in organised.items():
            with archive.open(f"{name}.npy", "w") as file:
                np.lib.format.write_array(file, array)
    scan = read_scan(tmp_path / "scan.npz")
    assert scan.shape == (HEIGHT, WIDTH)
    row, column = 2, 5
    point = row * WIDTH + column
    np.testing.assert_array_equal(scan.xyz[point], organised["xyz"][row, column])
    assert scan.fields["signal"][point] == organised["signal"][row, column]
    assert scan.fields["timestamp"][point] == organised["timestamp"][column]
    assert "beam_angles" not in scan.fields
    write_scan(tmp_path / "copy.npz", scan)
    with np.load(tmp_path / "copy.npz", allow_pickle=False) as copy:
        assert sorted(copy) == sorted(organised)
        for name, array in organised.items():
            expected = np.tile(array, (HEIGHT, 1)) if name == "timestamp" else array
            np.testing.assert_array_equal(copy[name], expected, strict=True)


@pytest.mark.parametrize("suffix", [".npy", ".npz"])
@pytest.mark.parametrize(
    "row",
    [
        [("x", "f4"), ("y", "f4"), ("z", "f4"), ("i", "u2"), ("normal", "f4", (3,))],
        [("xyz", "f4", (3,)), ("i", "f4")],
    ],
)
def test_a_structured_array_keeps_names_types_and_grid(tmp_path, suffix, row) -> None:
    table = np.zeros((2, 3), row)
    table["i"] = np.arange(6).reshape(2, 3)
    path = tmp_path / f"scan{suffix}"
    np.save(path, table) if suffix == ".npy" else np.savez(path, points=table)
    scan = read_scan(path)
    np.testing.assert_array_equal(scan.intensity, np.arange(6))
    write_scan(path, scan)
    copy = np.load(path) if suffix == ".npy" else np.load(path)["points"]
    np.testing.assert_array_equal(copy, table, strict=True)


class Fuse:
    """What must never go off while a file is read."""

    def __reduce__(self) -> tuple[Callable[[str], Any], tuple[str]]:
        return pytest.fail, ("a pickle was executed",)


def test_pickles_are_never_executed(tmp_path) -> None:
    array = np.array([Fuse()], object)
    np.save(tmp_path / "scan.npy", array, allow_pickle=True)
    np.savez(tmp_path / "scan.npz", xyz=array, allow_pickle=True)
    (tmp_path / "plain.npy").write_bytes(pickle.dumps(Fuse()))
    for name in ("scan.npy", "scan.npz", "plain.npy"):
        with pytest.raises(InputError, match="cannot be read as"):
            read_scan(tmp_path / name)


@pytest.mark.parametrize(
    "arrays",
    [
        np.float64(3),
        np.zeros((2, 2, 2, 4)),
        np.zeros(3, [("a", "f4")]),
        {"xyz": np.zeros((5, 2))},
        {"xyz": np.zeros(3)},
    ],
)
def test_arrays_that_are_no_points_are_refused(tmp_path, arrays) -> None:
    if isinstance(arrays, dict):
        np.savez(path := tmp_path / "scan.npz", **arrays)
    else:
        np.save(path := tmp_path / "scan.npy", arrays)
    with pytest.raises(InputError, match=re.escape(f"{path}: ")):
        read_scan(path)


@pytest.mark.parametrize("name", ["", "points"])
@pytest.mark.parametrize("shape", [(4, 100), (4, 30_000), (3, 100_000)])
def test_points_that_are_columns_are_refused_by_their_shape(tmp_path, name, shape) -> None:
    points = np.zeros(shape, np.float32)
    path = tmp_path / ("scan.npz" if name else "scan.npy")
    np.savez(path, **{name: points}) if name else np.save(path, points)
    with pytest.raises(InputError, match=f"shape {re.escape(str(shape))}.*a row for each point"):
        read_scan(path)


@pytest.mark.parametrize("name", ["", "points", "Points", "arr_0", "cloud"])
@pytest.mark.parametrize("shape", [(6, 4), (2, 3, 4), (0, 4)])
def test_a_table_alone_is_read_and_comes_back_with_its_grid(tmp_path, name, shape) -> None:
    rows = np.arange(np.prod(shape), dtype=">f8").reshape(shape)
    path = tmp_path / ("scan.npz" if name else "scan.npy")
    np.savez(path, **{name: rows}) if name else np.save(path, rows)
    scan = read_scan(path, ("z", "y", "x", "ring"))
    assert scan.shape == (shape[:2] if len(shape) == 3 else None)
    np.testing.assert_array_equal(scan.xyz, rows.reshape(-1, 4)[:, 2::-1])
    write_scan(path, scan)
    copy = np.load(path)
    assert not name or list(copy) == [name]
    np.testing.assert_array_equal(copy[name] if name else copy, rows, strict=True)


def test_points_may_have_further_arrays_beside_them(tmp_path) -> None:
    points = np.arange(24, dtype=np.float32).reshape(2, 3, 4)
    ring, time, beams = np.arange(6).reshape(2, 3), np.array([5, 6, 7]), np.array([-1.5, 1.5])
    np.savez(tmp_path / "scan.npz", ring=ring, points=points, time=time, beams=beams)
    scan = read_scan(tmp_path / "scan.npz")
    assert list(scan.fields) == ["x", "y", "z", "intensity", "ring", "time"]
    stay = np.array([True, False, True, True, False, True])
    write_scan(tmp_path / "clean.npz", scan.take(stay))
    with np.load(tmp_path / "clean.npz") as clean:
        assert set(clean) == {"points", "ring", "time", "beams"}
        np.testing.assert_array_equal(clean["points"], points.reshape(-1, 4)[stay], strict=True)
        np.testing.assert_array_equal(clean["ring"], ring.ravel()[stay])
        np.testing.assert_array_equal(clean["time"], np.array([5, 7, 5, 7]))
        np.testing.assert_array_equal(clean["beams"], beams)
    np.savez(tmp_path / "scan.npz", points=points, x=ring, y=ring, z=ring)
    assert list(read_scan(tmp_path / "scan.npz").fields) == ["points", "x", "y", "z"]
    np.savez(tmp_path / "scan.npz", points=points, intensity=ring)
    with pytest.raises(InputError, match="has an array intensity beside a column intensity"):
        read_scan(tmp_path / "scan.npz")


XYZ = np.arange(18, dtype=np.float32).reshape(6, 3)
GRID = {"xyz": XYZ.reshape(2, 3, 3)}


@pytest.mark.parametrize(
    ("points", "name", "shape"),
    [
        *(({"xyz": XYZ}, name, (5,)) for name in ("intensity", "i", "radar")),
        *(({"xyz": XYZ}, "intensity", shape) for shape in ((0,), (1,), (5, 1), (1, 6))),
        *((GRID, "intensity", shape) for shape in ((6,), (3, 2), (2,))),
        ({"points": XYZ}, "intensity", (5,)),
        ({"x": XYZ[:, 0], "y": XYZ[:, 1]}, "z", (5,)),
    ],
)
def test_an_array_by_the_name_of_a_column_is_of_as_many_points(
    tmp_path, points, name, shape
) -> None:
    np.savez(path := tmp_path / "scan.npz", **points, **{name: np.ones(shape, np.float32)})
    with pytest.raises(InputError, match=re.escape(f"{path}: the array {name} has shape {shape}")):
        read_scan(path, ("x", "y", "z"))


def test_what_is_not_read_by_its_name_may_be_of_any_length(tmp_path) -> None:
    others = {"signal": np.arange(9), "x": np.arange(4), "i": np.array(17), "beams": np.ones(2)}
    strength = np.arange(6, dtype=np.uint8)
    np.savez(tmp_path / "scan.npz", xyz=XYZ, intensity=strength, **others)
    scan = read_scan(tmp_path / "scan.npz")
    assert list(scan.fields) == ["xyz", "intensity"]
    write_scan(tmp_path / "clean.npz", scan.take(strength > 2))
    with np.load(tmp_path / "clean.npz") as clean:
        for name, array in others.items():
            np.testing.assert_array_equal(clean[name], array, strict=True)
    np.savez(tmp_path / "scan.npz", xyz=XYZ, i=others["i"], reflectivity=strength)
    np.testing.assert_array_equal(read_scan(tmp_path / "scan.npz").intensity, strength)


@pytest.mark.parametrize(
    ("coordinates", "grid"),
    [
        ({"xyz": XYZ}, (6,)),
        ({"x": XYZ[:, :1], "y": XYZ[:, 1], "z": XYZ[:, 2:]}, (6,)),
        (GRID, (2, 3)),
    ],
)
def test_a_column_that_stands_upright_is_read_and_written_as_it_was(
    tmp_path, coordinates, grid
) -> None:
    strength, path = np.arange(6, dtype=np.uint8), tmp_path / "scan.npz"
    upright = strength.reshape(*grid, 1)
    arrays = {**coordinates, "intensity": upright, "doppler": upright}
    np.savez(path, **arrays)
    scan = read_scan(path)
    np.testing.assert_array_equal(scan.xyz, XYZ)
    np.testing.assert_array_equal(scan.intensity, strength)
    write_scan(path, scan)
    with np.load(path) as copy:
        for name, array in arrays.items():
            np.testing.assert_array_equal(copy[name], array, strict=True)
    write_scan(path, scan.take(strength > 2))
    assert np.load(path)["intensity"].tolist() == [[3], [4], [5]]
    assert read_scan(path).channel("doppler").tolist() == [3, 4, 5]
    write_scan(flat := tmp_path / "scan.pcd", scan)
    np.testing.assert_array_equal(read_scan(flat).fields["doppler"], strength)


@pytest.mark.parametrize("suffix", [".npy", ".bin", ".pcd", ".ply"])
def test_coordinates_in_one_array_are_written_in_every_format(tmp_path, suffix) -> None:
    strength = np.arange(6, dtype=np.float32)
    np.savez(tmp_path / "scan.npz", xyz=XYZ, intensity=strength)
    write_scan(tmp_path / f"copy{suffix}", read_scan(tmp_path / "scan.npz"))
    copy = read_scan(tmp_path / f"copy{suffix}")
    np.testing.assert_array_equal(copy.xyz, XYZ)
    np.testing.assert_array_equal(copy.intensity, strength)
