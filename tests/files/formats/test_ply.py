"""PLY files: vertices with all of their properties."""

import struct
from pathlib import Path

import numpy as np
import pytest

from derain import InputError, Scan, ScanWarning
from derain.files import read_scan, write_scan
from derain.files.formats.ply import BYTE_ORDERS, PlyHeader

HEADER = """\
ply
format ascii 1.0
comment made by händ
obj_info two points
element vertex 2
property float x
property float32 y
property double z
property uchar intensity
element face 1
property list uchar int vertex_indices
end_header
"""
DATA = b"1.5 -2 0.1 7\nnan inf -0 255\n3 0 1 1\n"


@pytest.fixture
def file(tmp_path) -> Path:
    return tmp_path / "scan.ply"


def write(file: Path, header: str, data: bytes) -> Path:
    file.write_bytes(header.encode() + data)
    return file


def check_points(scan: Scan) -> None:
    x, y, z = np.float32([1.5, np.nan]), np.float32([-2, np.inf]), np.array([0.1, -0.0])
    expected = np.stack([x, y, z.astype(np.float32)], axis=1)
    np.testing.assert_array_equal(scan.xyz, expected, strict=True)
    np.testing.assert_array_equal(scan.fields["z"], z)
    np.testing.assert_array_equal(scan.fields["intensity"], np.uint8([7, 255]), strict=True)
    np.testing.assert_array_equal(scan.intensity, np.float32([7, 255]), strict=True)


def binary(order: str) -> bytes:
    vertices = [(1.5, -2.0, 0.1, 7), (float("nan"), float("inf"), -0.0, 255)]
    faces = struct.pack(f"{order}B3i", 3, 0, 1, 1)
    return b"".join(struct.pack(f"{order}ffdB", *vertex) for vertex in vertices) + faces


@pytest.mark.parametrize("encoding", BYTE_ORDERS)
def test_every_encoding_is_read(file, encoding) -> None:
    header = HEADER.replace("ascii", encoding)
    data = DATA if encoding == "ascii" else binary(BYTE_ORDERS[encoding])
    check_points(read_scan(write(file, header, data)))
    check_points(read_scan(write(file, header.replace("\n", "\r\n"), data)))


def test_a_cleaned_cloud_keeps_its_comments(file) -> None:
    scan = read_scan(write(file, HEADER, DATA))
    write_scan(file, scan.take(np.array([True, False])))
    assert file.read_text("utf-8").splitlines()[2:5] == [
        "comment made by händ", "obj_info two points", "element vertex 1"
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("header", "data"),
    [
        (HEADER, b""),
        (HEADER, b"1 2 3 4\n5 6 7\n"),
        (HEADER, b"1 2 3 4\n5 6 7 256\n"),
        (HEADER.replace("ascii", "binary_little_endian"), binary("<")[:33]),
        (HEADER.replace("vertex 2", "vertex 99999999999999999999"), DATA),
        (HEADER.replace("vertex 2", "points 2"), DATA),
        (HEADER.replace("element vertex", "element camera 0\nelement vertex"), DATA),
        ("ply\nformat ascii 1.0\nelement vertex 2\nend_header\n", DATA),
        (HEADER.replace("format ascii 1.0\n", ""), DATA),
        (HEADER.replace("format ascii 1.0", "format ascii 2.0"), DATA),
        (HEADER.replace("uchar intensity", "complex intensity"), DATA),
        (HEADER.replace("end_header\n", ""), DATA),
        (HEADER.replace("uchar intensity", "list uchar int echoes"), DATA),
        (HEADER.replace("ply", "obj"), DATA),
    ],
)
def test_damaged_files_are_refused(file, header, data) -> None:
    with pytest.raises(InputError, match=r"scan\.ply: cannot be read as \.ply \(.*write it again"):
        read_scan(write(file, header, data))


@pytest.mark.parametrize("encoding", BYTE_ORDERS)
def test_elements_that_are_not_written_are_listed_unless_they_are_empty(file, encoding) -> None:
    data = DATA if encoding == "ascii" else binary(BYTE_ORDERS[encoding])
    header = HEADER.replace("ascii", encoding)
    for text, lost in (
        (header, ("face",)),
        (header.replace("face 1", "face 0"), ()),
        (header.replace("face 1", f"face {10**18}"), ("face",)),
    ):
        scan = read_scan(write(file, text, data))
        check_points(scan)
        assert isinstance(scan.header, PlyHeader)
        assert scan.header.left_out == lost
    with pytest.warns(ScanWarning, match="lacks its face"):
        write_scan(file, scan)
    assert b"face" not in file.read_bytes()
    check_points(read_scan(file))
