"""PCD files: read as the Point Cloud Library writes them, written as others can read them."""

import math
import struct
from dataclasses import replace
from pathlib import Path

import lzf
import numpy as np
import pytest

from derain import InputError, Scan
from derain.files import read_scan, write_scan
from derain.files.formats.pcd import ENCODINGS, PcdHeader

HEADER = """\
# .PCD v.7 - Point Cloud Data file format
VERSION .7
FIELDS x y z intensity
SIZE 4 4 4 2
TYPE F F F U
COUNT 1 1 1 1
WIDTH 2
HEIGHT 1
VIEWPOINT 1 2 3 0.5 0.5 0.5 0.5
POINTS 2
DATA binary
"""
POINTS = ((1.5, -2.0, 0.25, 7), (math.nan, math.inf, -0.0, 65535))
DATA = b"".join(struct.pack("<fffH", *point) for point in POINTS)


@pytest.fixture
def file(tmp_path) -> Path:
    return tmp_path / "scan.pcd"


def write(file: Path, header: str, data: bytes) -> Path:
    file.write_bytes(header.encode() + data)
    return file


def compress(data: bytes) -> bytes:
    compressed = lzf.compress(data, 2 * len(data) + 64)
    return struct.pack("<II", len(compressed), len(data)) + compressed


def column_by_column() -> bytes:
    columns = zip("fffH", zip(*POINTS, strict=True), strict=True)
    return b"".join(struct.pack(f"<2{kind}", *values) for kind, values in columns)


ENCODED = {
    "binary": DATA,
    "ascii": b"1.5 -2 .25 7\nnan inf -0 65535\n",
    "binary_compressed": compress(column_by_column()),
}


def check_points(scan: Scan) -> None:
    expected = np.array([point[:3] for point in POINTS], np.float32)
    np.testing.assert_array_equal(scan.xyz, expected, strict=True)
    np.testing.assert_array_equal(scan.intensity, np.float32([7, 65535]), strict=True)
    np.testing.assert_array_equal(scan.fields["intensity"], np.uint16([7, 65535]), strict=True)


@pytest.mark.parametrize(
    ("encoding", "data"),
    [
        *ENCODED.items(),
        ("ascii", b"  1.5\t-2e0 +0.25 7\r\n\r\nNaN Infinity -0.0 65535"),
        ("binary", DATA + b"\n"),
    ],
)
def test_every_encoding_is_read(file, encoding, data) -> None:
    check_points(read_scan(write(file, HEADER.replace("DATA binary", f"DATA {encoding}"), data)))


def test_headers_may_lack_what_is_optional_and_hold_comments_in_any_encoding(file) -> None:
    optional = ("COUNT", "HEIGHT", "POINTS", "VIEWPOINT")
    lines = [line for line in HEADER.splitlines() if not line.startswith(optional)]
    header = b"\r\n".join([b"# Stra\xdfe", b"", *(line.encode() for line in lines), b""])
    file.write_bytes(header + DATA)
    scan = read_scan(file)
    check_points(scan)
    write_scan(file, scan)
    assert b"VIEWPOINT 0 0 0 1 0 0 0\n" in file.read_bytes()


def test_padding_is_passed_over_in_every_encoding(file) -> None:
    header = (
        HEADER.replace("FIELDS x y z intensity", "FIELDS x y z _ intensity _")
        .replace("SIZE 4 4 4 2", "SIZE 4 4 4 1 2 4")
        .replace("TYPE F F F U", "TYPE F F F U U F")
        .replace("COUNT 1 1 1 1", "COUNT 1 1 1 4 1 2")
    )
    rows = [struct.pack("<fff4xH8x", *point) for point in POINTS]
    block = column_by_column()
    padded = block[:24] + bytes(8) + block[24:] + bytes(16)
    for encoding, data in (
        ("binary", b"".join(rows)),
        ("ascii", b"1.5 -2 .25 0 0 0 0 7 0 0\nnan inf -0 0 0 0 0 65535 0 0\n"),
        ("binary_compressed", compress(block)),
        ("binary_compressed", compress(padded)),
    ):
        scan = read_scan(write(file, header.replace("DATA binary", f"DATA {encoding}"), data))
        check_points(scan)
        assert list(scan.fields) == ["x", "y", "z", "intensity"]


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_encoding_viewpoint_and_order_of_columns_survive_and_the_grid_until_it_is_cleaned(
    file, scan, encoding
) -> None:
    header = PcdHeader((), 0, 0, 0, encoding, "1 2 3 0.5 0.5 0.5 0.5")
    write_scan(file, replace(scan.take(np.arange(4)), shape=(2, 2), header=header))
    first = file.read_bytes()
    stated = f"VIEWPOINT 1 2 3 0.5 0.5 0.5 0.5\nPOINTS {{}}\nDATA {encoding}\n"
    assert f"WIDTH 2\nHEIGHT 2\n{stated.format(4)}".encode() in first
    copy = read_scan(file)
    assert copy.shape == (2, 2)
    assert list(copy.fields) == list(scan.fields)
    write_scan(file, copy)
    assert file.read_bytes() == first
    write_scan(file, copy.take(np.array([True, False, True, True])))
    assert f"WIDTH 3\nHEIGHT 1\n{stated.format(3)}".encode() in file.read_bytes()


@pytest.mark.parametrize(
    ("stated", "shape"),
    [
        ("WIDTH 9\nHEIGHT 1\nPOINTS 2", None),
        ("WIDTH 1\nHEIGHT 2\nPOINTS 9", (2, 1)),
        ("WIDTH 1\nHEIGHT 1\nPOINTS 1", None),
    ],
)
def test_a_wrong_number_of_points_is_overruled_by_the_data(file, stated, shape) -> None:
    header = HEADER.replace("HEIGHT 1\n", "").replace("POINTS 2\n", "").replace("WIDTH 2", stated)
    for encoding, data in ENCODED.items():
        scan = read_scan(write(file, header.replace("DATA binary", f"DATA {encoding}"), data))
        check_points(scan)
        assert scan.shape == shape


@pytest.mark.parametrize(
    ("encoding", "data"),
    [
        *(("binary", data) for data in (DATA[:-1], DATA + b"garba" * 3)),
        *(("ascii", b"1 2 3 4\n" + line) for line in (b"", b"1 2 3", b"1 2 3 65536")),
        ("binary_compressed", b""),
        ("binary_compressed", compress(column_by_column()[:-2])),
        ("binary_compressed", struct.pack("<II", 2, 28) + b"\0A"),
    ],
)
def test_data_that_do_not_match_the_header_are_refused(file, encoding, data) -> None:
    header = HEADER.replace("DATA binary", f"DATA {encoding}")
    with pytest.raises(InputError, match=r"scan\.pcd: cannot be read as \.pcd \(.*write it again"):
        read_scan(write(file, header, data))
    with pytest.raises(InputError, match="points where the header states 99"):
        read_scan(write(file, HEADER.replace("POINTS 2", "POINTS 99"), DATA * 3))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("DATA binary\n", ""),
        ("DATA binary", "DATA zipped"),
        ("FIELDS x y z intensity", "FIELDS x y z x"),
        ("FIELDS x y z intensity", "FIELDS _ _ _ _"),
        ("SIZE 4", "SIZE four"),
        ("TYPE F F F U", "TYPE F F F F"),
        ("COUNT 1 1 1 1", "COUNT 1 1 1 0"),
        ("WIDTH 2", "WIDTH 2.5"),
    ],
)
def test_headers_that_make_no_sense_are_refused(file, old, new) -> None:
    assert old in HEADER
    with pytest.raises(InputError, match=r"read as \.pcd \(the header (states|has no) "):
        read_scan(write(file, HEADER.replace(old, new), DATA))
