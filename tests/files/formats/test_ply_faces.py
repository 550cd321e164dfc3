"""Meshes in PLY files: the faces whose vertices stay, stay with them."""

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from derain.files import read_scan, write_scan
from derain.files.formats.ply import PlyHeader
from derain.files.formats.ply.header import BYTE_ORDERS

POINTS = np.arange(18, dtype=np.float32).reshape(6, 3)
TRIANGLES = [(0, 1, 2), (2, 3, 4), (5, 4, 3), (1, 3, 5)]


def mesh(faces: list[tuple[int, ...]], encoding: str, behind: str = "") -> bytes:
    """A file of POINTS and of faces, each with a quality before and a colour behind its list."""
    lines = [
        *("ply", f"format {encoding} 1.0", "element vertex 6"),
        *(f"property float {axis}" for axis in "xyz"),
        *(f"element face {len(faces)}", "property float quality"),
        *("property list uchar int vertex_indices", "property uchar red", behind, "end_header"),
    ]
    header = "".join(f"{line}\n" for line in lines if line).encode()
    rows = [(0.5 * place, len(face), *face, place) for place, face in enumerate(faces)]
    if encoding == "ascii":
        text = [*POINTS.astype(int).tolist(), *([f"{row[0]:g}", *row[1:]] for row in rows)]
        return header + "".join(" ".join(map(str, line)) + "\n" for line in text).encode()
    order = BYTE_ORDERS[encoding]
    data = [struct.pack(f"{order}fB{len(row) - 3}iB", *row) for row in rows]
    return header + POINTS.astype(f"{order}f4").tobytes() + b"".join(data)


def left_out(path: Path) -> tuple[str, ...]:
    header = read_scan(path).header
    assert isinstance(header, PlyHeader)
    return header.left_out


@pytest.mark.parametrize("encoding", BYTE_ORDERS)
def test_a_mesh_that_loses_nothing_comes_back_byte_for_byte(tmp_path: Path, encoding: str) -> None:
    path = tmp_path / "mesh.ply"
    path.write_bytes(mesh(TRIANGLES, encoding))
    assert left_out(path) == ()
    write_scan(tmp_path / "copy.ply", read_scan(path))
    assert (tmp_path / "copy.ply").read_bytes() == path.read_bytes()


@pytest.mark.parametrize("encoding", BYTE_ORDERS)
def test_faces_of_vertices_that_stay_are_renumbered(
    tmp_path: Path, encoding: str, open3d: Any
) -> None:
    path = tmp_path / "mesh.ply"
    path.write_bytes(mesh(TRIANGLES, encoding))
    stay = np.array([True, False, True, True, True, True])
    write_scan(path, read_scan(path).take(stay))
    read = open3d.io.read_triangle_mesh(str(path))
    np.testing.assert_array_equal(np.asarray(read.vertices), POINTS[stay])
    faces = [face for face in TRIANGLES if stay[list(face)].all()]
    assert len(faces) == 2
    # The corners are the same points as before, whatever their numbers are.
    corners = np.asarray(read.vertices)[np.asarray(read.triangles)]
    np.testing.assert_array_equal(corners, POINTS[np.array(faces)])
    assert read_scan(path).header.faces.table["red"].tolist() == [1, 2]


def test_faces_follow_vertices_in_any_order_and_the_first_of_those_taken_twice(
    tmp_path: Path,
) -> None:
    path = tmp_path / "mesh.ply"
    path.write_bytes(mesh(TRIANGLES, "ascii"))
    scan = read_scan(path)
    for rows, lines in (
        ([5, 3, 1], ["1.5 3 2 1 0 3"]),
        ([*range(6), *range(6)[::-1]], mesh(TRIANGLES, "ascii").decode().splitlines()[-4:]),
    ):
        write_scan(path, scan.take(np.array(rows)))
        assert path.read_text().splitlines()[-len(lines) :] == lines


@pytest.mark.parametrize("encoding", BYTE_ORDERS)
@pytest.mark.parametrize(
    ("faces", "cut"),
    [([*TRIANGLES, (0, 1, 2, 3)], 0), ([(0, 1, 6)], 0), ([(0, 1, -1)], 0), (TRIANGLES, 12)],
    ids=["mixed", "far", "minus", "cut off"],
)
def test_faces_that_cannot_follow_are_left_out_and_said_to_be(
    tmp_path: Path, encoding: str, faces: list[tuple[int, ...]], cut: int
) -> None:
    path = tmp_path / "mesh.ply"
    content = mesh(faces, encoding)
    path.write_bytes(content[: len(content) - cut])
    assert left_out(path) == ("face",)
    write_scan(path, read_scan(path))
    assert b"face" not in path.read_bytes()
    np.testing.assert_array_equal(read_scan(path).xyz, POINTS)


def test_other_elements_are_said_to_be_left_out(tmp_path: Path) -> None:
    path = tmp_path / "mesh.ply"
    path.write_bytes(mesh(TRIANGLES, "ascii", "element edge 1\nproperty int vertex1") + b"3\n")
    assert left_out(path) == ("edge",)
    write_scan(path, read_scan(path))
    assert path.read_bytes() == mesh(TRIANGLES, "ascii")
