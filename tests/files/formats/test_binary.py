"""Float32 rows."""

from pathlib import Path

import numpy as np
import pytest

from derain import InputError, Scan
from derain.files import DEFAULT_COLUMNS, read_scan, write_scan
from derain.files.formats.binary import Binary
from derain.scan import Float32s

FIVE = (*DEFAULT_COLUMNS, "ring")
SIX = (*FIVE, "time")


@pytest.fixture
def file(tmp_path) -> Path:
    return tmp_path / "scan.bin"


def street(points: int, width: int, azimuth: float = np.pi) -> Float32s:
    """A flat street with walls, seen from 1.7 m above: x y z intensity ring time ... (N, width)."""
    generator = np.random.default_rng(width)
    distance = generator.uniform(2, 60, points)
    angle = generator.uniform(-azimuth, azimuth, points)
    height = np.where(generator.random(points) < 0.7, -1.7, generator.uniform(-1.7, 5, points))
    ring = generator.integers(0, 64, points)
    time = np.linspace(0, 0.1, points)
    rows = [distance * np.cos(angle), distance * np.sin(angle), height, generator.random(points)]
    return np.column_stack([*rows, ring, time, *[ring] * 4])[:, :width].astype(np.float32)


def test_a_file_is_whole_rows_or_empty(file) -> None:
    file.write_bytes(bytes(50))
    with pytest.raises(InputError, match=r"50 bytes are not whole rows of 16 bytes.*--columns"):
        read_scan(file)
    file.write_bytes(bytes(64))
    with pytest.raises(InputError, match="not whole rows"):
        read_scan(file, ())
    with pytest.raises(InputError, match="a name comes twice"):
        read_scan(file, ("x", "y", "z", "x"))
    file.write_bytes(b"")
    scan = read_scan(file)
    assert len(scan) == 0
    write_scan(file, scan)
    assert file.read_bytes() == b""


@pytest.mark.parametrize(
    ("width", "columns"), [*((wide, DEFAULT_COLUMNS) for wide in (5, 6, 7)), (4, FIVE)]
)
@pytest.mark.parametrize("azimuth", [np.pi, np.pi / 3], ids=["full circle", "front"])
def test_rows_of_another_width_than_stated_are_refused(file, width, columns, azimuth) -> None:
    file.write_bytes(street(2000, width, azimuth).tobytes())
    with pytest.raises(InputError, match=r"more columns than stated.*--columns x,y,z,intensity"):
        read_scan(file, columns)


def test_sentinel_cells_damaged_rows_and_a_few_negative_values_are_no_reason_to_refuse(
    file,
) -> None:
    rows = street(1000, 4)
    rows[:400] = -1
    rows[400:700, 3] = -np.inf
    rows[700:720, 3] = -12.5
    file.write_bytes(rows.tobytes())
    assert len(read_scan(file)) == 1000
    rows[:, 3] = -30
    file.write_bytes(rows.tobytes())
    assert read_scan(file, ("x", "y", "z", "rcs")).intensity is None


def test_a_column_that_would_lose_digits_is_not_written(file) -> None:
    fields = {axis: np.ones(2, np.float32) for axis in "xyz"} | {"time": np.array([1, 2**24 + 1])}
    with pytest.raises(InputError, match=r"float32 cannot hold the column time \(int64\)"):
        write_scan(file, Scan(np.ones((2, 3), np.float32), fields=fields))
    assert not file.exists()


@pytest.mark.parametrize("columns", [("z", "y", "x", "intensity"), FIVE, SIX], ids=len)
@pytest.mark.parametrize("origin", [np.float32, np.float64])
def test_float64_is_recognised_and_written_back(file, columns, origin) -> None:
    # What was float32 before has 29 bits of zeros behind each number.
    rows = (street(2000, len(columns)).astype(np.float64) * np.pi).astype(origin).astype("<f8")
    file.write_bytes(rows.tobytes())
    scan = read_scan(file, columns)
    np.testing.assert_array_equal(np.stack(list(scan.fields.values()), axis=1), rows, strict=True)
    np.testing.assert_array_equal(scan.xyz[:, 1], rows[:, columns.index("y")].astype(np.float32))
    np.testing.assert_array_equal(scan.xyz[:, 2], rows[:, columns.index("z")].astype(np.float32))
    assert Binary().count(file, columns) == 2000
    write_scan(file, scan.take(np.arange(2000) % 2 == 0))
    assert file.read_bytes() == rows[::2].tobytes()


@pytest.mark.parametrize("columns", [DEFAULT_COLUMNS, FIVE, SIX], ids=len)
def test_float32_is_not_taken_for_float64(file, columns) -> None:
    rows = street(2000, len(columns))
    for damaged in (rows, np.where(np.arange(2000)[:, None] % 2 == 0, np.float32(1e-40), rows)):
        file.write_bytes(damaged.astype("<f4").tobytes())
        read = np.stack(list(read_scan(file, columns).fields.values()), axis=1)
        np.testing.assert_array_equal(read, damaged, strict=True)
        assert Binary().count(file, columns) == 2000


def test_float64_that_makes_as_good_sense_as_float32_stays_float32(file) -> None:
    # Whole numbers, which have nothing but zeros in the half that float32 would stumble over.
    rows = np.random.default_rng(0).integers(1, 60, (100, 4)).astype("<f8")
    file.write_bytes(rows.tobytes())
    assert len(read_scan(file)) == 200
