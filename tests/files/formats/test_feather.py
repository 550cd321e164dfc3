"""Feather files, as Argoverse 2 has them: every column comes back, numbers or not."""

from dataclasses import replace

import numpy as np
import pyarrow
import pytest
from pyarrow import feather

from derain.errors import InputError
from derain.files import read_scan, write_scan


@pytest.fixture
def table() -> pyarrow.Table:
    """Seven points with the columns of Argoverse 2, and some that are no numbers."""
    generator = np.random.default_rng(0)
    columns = {axis: generator.normal(0, 30, 7).astype(np.float16) for axis in "xyz"}
    columns |= {
        "intensity": generator.integers(0, 256, 7).astype(np.uint8),
        "laser_number": generator.integers(0, 64, 7).astype(np.uint8),
        "offset_ns": generator.integers(0, 10**8, 7).astype(np.int32),
    }
    further = {
        "name": ["car", "", None, "ä", "b", "c", "d"],
        "echo": pyarrow.array([1, None, 3, 4, 5, 6, 7], pyarrow.int16()),
        "wet": [True, False, None, True, True, False, True],
        "beams": [[1], [], [2, 3], [4], [5], [6], [7]],
    }
    return pyarrow.table({**columns, **further}).replace_schema_metadata({"sensor": "up_lidar"})


@pytest.mark.parametrize("compression", ["uncompressed", "lz4", "zstd"])
def test_a_file_comes_back_byte_for_byte_and_cleaned_without_the_other_rows(
    tmp_path, table, compression
) -> None:
    path = tmp_path / "scan.feather"
    feather.write_feather(table, str(path), compression)
    scan = read_scan(path)
    for place, axis in enumerate("xyz"):
        expected = table[axis].to_numpy()
        np.testing.assert_array_equal(scan.fields[axis], expected, strict=True)
        np.testing.assert_array_equal(scan.xyz[:, place], expected.astype(np.float32))
    np.testing.assert_array_equal(scan.intensity, table["intensity"].to_numpy())
    np.testing.assert_array_equal(scan.fields["echo"], [1, np.nan, 3, 4, 5, 6, 7])
    assert set(scan.fields) == set(table.column_names) - {"name", "wet", "beams"}
    write_scan(tmp_path / "copy.feather", scan)
    assert (tmp_path / "copy.feather").read_bytes() == path.read_bytes()
    stay = np.array([True, False, True, True, False, True, True])
    write_scan(path, scan.take(stay))
    assert feather.read_table(str(path)).equals(table.filter(stay), check_metadata=True)


def test_columns_that_were_changed_are_written_and_others_kept(tmp_path, table) -> None:
    path = tmp_path / "scan.feather"
    feather.write_feather(table, str(path))
    scan = read_scan(path)
    fields = {**scan.fields, "x": np.zeros(7), "new": np.ones(7, ">i2")}
    changed = replace(scan, fields=fields)
    write_scan(path, changed)
    copy = feather.read_table(str(path))
    assert copy.column_names == [*table.column_names, "new"]
    assert copy["x"].to_pylist() == [0.0] * 7
    assert copy["new"].to_pylist() == [1] * 7
    assert copy.drop(["x", "new"]).equals(table.drop(["x"]))


def test_version_1_is_refused(tmp_path) -> None:
    path = tmp_path / "scan.feather"
    path.write_bytes(b"FEA1" + bytes(100))
    with pytest.raises(InputError, match="version 2"):
        read_scan(path)
