"""PLY files: vertices with all of their properties, and the faces whose vertices stay."""

import struct
from pathlib import Path

import numpy as np
import pytest

from derain import InputError, Scan
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


def test_elements_before_the_vertices_are_passed_over(file) -> None:
    camera = "element camera 2\nproperty double angle\nproperty short id\nelement vertex"
    header = HEADER.replace("element vertex", camera)
    check_points(read_scan(write(file, header, b"1 2\n3 4\n" + DATA)))
    data = struct.pack("<dhdh", 1, 2, 3, 4) + binary("<")
    check_points(read_scan(write(file, header.replace("ascii", "binary_little_endian"), data)))


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


POINTS = np.arange(18, dtype=np.float32).reshape(6, 3)
TRIANGLES = [(0, 1, 2), (2, 3, 4), (5, 4, 3), (1, 3, 5)]


def mesh(faces: list[tuple[int, ...]], encoding: str, behind: str = "") -> bytes:
    """A file of POINTS and of faces, each with a quality and a colour behind its list."""
    lines = [
        *("ply", f"format {encoding} 1.0", "element vertex 6"),
        *(f"property float {axis}" for axis in "xyz"),
        *(f"element face {len(faces)}", "property list uchar int vertex_indices"),
        *("property float quality", "property uchar red", behind, "end_header"),
    ]
    header = "".join(f"{line}\n" for line in lines if line).encode()
    rows = [(len(face), *face, 0.5 * place, place) for place, face in enumerate(faces)]
    if encoding == "ascii":
        text = [
            *POINTS.astype(int).tolist(),
            *([*row[:-2], f"{row[-2]:g}", row[-1]] for row in rows),
        ]
        return header + "".join(" ".join(map(str, line)) + "\n" for line in text).encode()
    order = BYTE_ORDERS[encoding]
    data = [struct.pack(f"{order}B{len(row) - 3}ifB", *row) for row in rows]
    return header + POINTS.astype(f"{order}f4").tobytes() + b"".join(data)


def left_out(path: Path) -> tuple[str, ...]:
    header = read_scan(path).header
    assert isinstance(header, PlyHeader)
    return header.left_out


@pytest.mark.parametrize("encoding", BYTE_ORDERS)
def test_a_mesh_that_loses_nothing_comes_back_byte_for_byte(file, encoding) -> None:
    whole = mesh(TRIANGLES, encoding)
    more = mesh(TRIANGLES, encoding, "element edge 1\nproperty uchar vertex1")
    more += b"3\n" if encoding == "ascii" else b"3"
    for content, lost in ((whole, ()), (more, ("edge",))):
        file.write_bytes(content)
        assert left_out(file) == lost
        write_scan(file, read_scan(file))
        assert file.read_bytes() == whole


def test_faces_of_another_cloud_are_not_written(file) -> None:
    file.write_bytes(mesh(TRIANGLES, "ascii"))
    of_mesh = read_scan(file)
    write_scan(file, Scan(of_mesh.xyz[:2], header=of_mesh.header))
    assert b"face" not in file.read_bytes()


def test_faces_follow_vertices_in_any_order_and_the_first_of_those_taken_twice(file) -> None:
    file.write_bytes(mesh(TRIANGLES, "ascii"))
    scan = read_scan(file)
    for rows, lines in (
        (np.arange(6) != 1, ["3 1 2 3 0.5 1", "3 4 3 2 1 2"]),
        ([5, 3, 1], ["3 2 1 0 1.5 3"]),
        ([*range(6), *range(6)[::-1]], mesh(TRIANGLES, "ascii").decode().splitlines()[-4:]),
    ):
        write_scan(file, scan.take(np.array(rows)))
        written = file.read_text().splitlines()
        assert f"element face {len(lines)}" in written
        assert written[-len(lines) :] == lines


@pytest.mark.parametrize("encoding", BYTE_ORDERS)
@pytest.mark.parametrize(
    ("faces", "cut"),
    [([*TRIANGLES, (0, 1, 2, 3)], 0), ([(0, 1, 6)], 0), ([(0, 1, -1)], 0), (TRIANGLES, 12)],
)
def test_faces_that_cannot_follow_are_left_out_with_a_warning(file, encoding, faces, cut) -> None:
    content = mesh(faces, encoding)
    file.write_bytes(content[: len(content) - cut])
    assert left_out(file) == ("face",)
    write_scan(file, read_scan(file))
    assert b"face" not in file.read_bytes()
    np.testing.assert_array_equal(read_scan(file).xyz, POINTS)
    file.write_bytes(mesh(TRIANGLES, encoding).replace(b"uchar int vertex", b"uchar float vertex"))
    assert left_out(file) == ("face",)
