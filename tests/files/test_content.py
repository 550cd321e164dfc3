"""Small files that claim or hold far more than any scan are refused before they take memory."""

import gzip
import io
import os
import struct
import tracemalloc
import zipfile
from collections.abc import Callable
from pathlib import Path

import laspy
import lzf
import numpy as np
import pyarrow
import pytest
from pyarrow import feather

from derain import InputError, Scan
from derain.evaluation.hard_cases import scene
from derain.files import read_scan, write_scan
from derain.files.content import (
    LARGEST_EXPANSION,
    LARGEST_SCAN,
    SMALLEST_BUDGET,
    MemoryBudget,
    read_content,
)
from derain.files.labels import read_labels
from derain.files.reading import reading

# A float32 x, y, z and intensity for each of seven million points.
BOMB = 7 * 2**24

PCD = """\
VERSION .7
FIELDS x y z intensity
SIZE 4 4 4 4
TYPE F F F F
COUNT 1 1 1 {count}
WIDTH {points}
HEIGHT 1
POINTS {points}
DATA {encoding}
"""
PLY = """\
ply
format {encoding} 1.0
element vertex {points}
property float x
property float y
property float z
element face {faces}
property list uint int vertex_indices
end_header
"""


def pcd(data: bytes, encoding: str, points: int = 1, count: int = 1) -> bytes:
    return PCD.format(encoding=encoding, points=points, count=count).encode() + data


def wide_pcd(columns: int) -> bytes:
    header = pcd(b"", "binary", points=0).decode()
    for key, value in (("FIELDS", "f{}"), ("SIZE", "1"), ("TYPE", "U"), ("COUNT", "1")):
        further = " ".join(value.format(place) for place in range(columns))
        header = header.replace(key, f"{key} {further}")
    return header.encode()


def lzf_bomb() -> bytes:
    plain = bytes(BOMB)
    compressed = lzf.compress(plain, BOMB)
    sizes = struct.pack("<II", len(compressed), BOMB)
    return pcd(sizes + compressed, "binary_compressed", BOMB // 16)


def npy(shape: tuple[int, ...], descr: object = "<f4", data: bytes = bytes(64)) -> bytes:
    file = io.BytesIO()
    header = {"descr": descr, "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(file, header)
    return file.getvalue() + data


def npz(**members: bytes) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, content in members.items():
            archive.writestr(f"{name}.npy", content)
    return file.getvalue()


def lying_npz() -> bytes:
    """A member that states 200 bytes and expands to many more."""
    honest = npz(points=npy((BOMB // 16, 4), data=bytes(BOMB)))
    size = struct.pack("<I", BOMB + 128)
    assert honest.count(size) == 2
    return honest.replace(size, struct.pack("<I", 200))


def repeated_rows() -> bytes:
    """Coordinates of a column of a million points, and twenty values to repeat for each."""
    points = npy((10**6, 1, 3), "|u1", bytes(3 * 10**6))
    return npz(xyz=points, **{f"column{place}": npy((1,), "<f8") for place in range(20)})


def las(offset: int, value: bytes, suffix: str = ".las") -> bytes:
    survey = laspy.LasData(laspy.LasHeader(version="1.4", point_format=6))
    survey.x = survey.y = survey.z = np.arange(9.0)
    file = io.BytesIO()
    survey.write(file, do_compress=suffix == ".laz", laz_backend=laspy.LazBackend.Lazrs)
    content = file.getvalue()
    return content[:offset] + value + content[offset + len(value) :]


def laz_with(where: str) -> bytes:
    """A LAZ file that states four billion chunks, or a layer of four billion bytes."""
    content = las(0, b"", ".laz")
    (begin,) = struct.unpack_from("<I", content, 96)
    (table,) = struct.unpack_from("<q", content, begin)
    place = table + 4 if where == "chunks" else begin + 8 + 30 + 4
    return content[:place] + b"\xf0\xff\xff\xff" + content[place + 4 :]


def feather_bomb(compression: str) -> bytes:
    zeros = np.zeros(BOMB // 16, np.float32)
    sink = pyarrow.BufferOutputStream()
    table = pyarrow.table(dict.fromkeys(("x", "y", "z", "intensity"), zeros))
    feather.write_feather(table, sink, compression, chunksize=BOMB)
    return bytes(sink.getvalue())


HOSTILE: dict[str, tuple[str, Callable[[], bytes], str]] = {
    "count": (".pcd", lambda: pcd(b"1 2 3 4\n", "ascii", count=534231007), "COUNT 534231007"),
    "count of words": (".pcd", lambda: pcd(b"1 2 3 4\n", "ascii", count=9999), "states 10002"),
    "points": (".pcd", lambda: pcd(bytes(64), "binary", 10**18), "10{18}"),
    "columns": (".pcd", lambda: wide_pcd(2000), "2,004 columns"),
    "header": (".pcd", lambda: wide_pcd(10**5), "no DATA line"),
    "lzf": (".pcd", lzf_bomb, "room for"),
    "lzf size": (
        ".pcd",
        lambda: pcd(struct.pack("<II", 9, 2**32 - 16) + bytes(9), "binary_compressed", 2**28 - 1),
        "room for",
    ),
    "gzip": (".bin.gz", lambda: gzip.compress(bytes(BOMB), 1), "room for"),
    "gzip twice": (
        ".npz.gz",
        lambda: gzip.compress(npz(points=npy((BOMB // 16, 4), data=bytes(BOMB)))),
        "room for",
    ),
    "zip": (".npz", lambda: npz(points=npy((BOMB // 16, 4), data=bytes(BOMB))), "room for"),
    "zip that lies": (".npz", lying_npz, "CRC|header"),
    "zip members": (".npz", lambda: npz(**{f"a{n}": b"" for n in range(1100)}), "1,100 columns"),
    "repeated rows": (".npz", repeated_rows, "room for"),
    "shape": (".npy", lambda: npy((10**12, 4)), "bytes in the header"),
    "item size": (".npy", lambda: npy((1,), [("x", "<f4", (2**28,))]), "bytes in the header"),
    "columns of nothing": (".npy", lambda: npy((0, 10**9)), "1,000,000,000 columns"),
    "objects": (".npy", lambda: npy((10**12,), "|O"), "allow_pickle=False"),
    "vertices": (
        ".ply",
        lambda: PLY.format(encoding="ascii", points=10**18, faces=0).encode() + b"1 2 3\n",
        "10{18}",
    ),
    "binary vertices": (
        ".ply",
        lambda: PLY.format(encoding="binary_big_endian", points=10**18, faces=0).encode(),
        "10{18}",
    ),
    "values in a line": (".csv", lambda: b"1," * 10**5 + b"1\n", "100,001 columns"),
    "value": (".csv", lambda: b"x,y,z\n1,2," + b"9" * 10**6, "field larger|not a number"),
    "text points": (".las", lambda: las(247, struct.pack("<Q", 2**40)), "room for"),
    "records": (".las", lambda: las(100, b"\xff\xff\xff\xff"), "records in the header"),
    "far records": (".las", lambda: las(243, b"\xff\xff\xff\xff"), "records in the header"),
    "chunks": (".laz", lambda: laz_with("chunks"), "4,294,967,280 chunks"),
    "layers": (".laz", lambda: laz_with("layers"), "a chunk that is not in the file"),
    "lz4": (".feather", lambda: feather_bomb("lz4"), "room for"),
    "zstd": (".feather", lambda: feather_bomb("zstd"), "room for"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_small_files_cannot_take_much_memory(tmp_path: Path, name: str) -> None:
    suffix, content, reason = HOSTILE[name]
    path = tmp_path / f"scan{suffix}"
    path.write_bytes(content())
    assert path.stat().st_size < 2 * 10**6
    tracemalloc.start()
    arrow = pyarrow.default_memory_pool()
    before = arrow.max_memory()
    try:
        with pytest.raises(InputError, match=reason):
            read_scan(path)
        assert tracemalloc.get_traced_memory()[1] < 2 * SMALLEST_BUDGET
        assert arrow.max_memory() == before
    finally:
        tracemalloc.stop()


def test_faces_that_claim_billions_of_vertices_leave_the_points(tmp_path: Path) -> None:
    path = tmp_path / "scan.ply"
    header = PLY.format(encoding="binary_little_endian", points=1, faces=10**18).encode()
    path.write_bytes(header + bytes(12) + b"\xff\xff\xff\x7f" + bytes(40))
    assert len(read_scan(path)) == 1


@pytest.mark.parametrize("size", [0, 10**6, SMALLEST_BUDGET, LARGEST_SCAN])
def test_room_grows_with_the_file_between_two_bounds(size: int) -> None:
    budget = MemoryBudget(size)
    most = min(max(SMALLEST_BUDGET, LARGEST_EXPANSION * size), LARGEST_SCAN)
    budget.reserve(most - 1)
    budget.reserve(1)
    with pytest.raises(ValueError, match="room for 0"):
        budget.reserve(1)


def test_what_compresses_as_well_as_real_scans_and_better_is_read(tmp_path: Path) -> None:
    points = scene(20_000)
    points[1000:, 3] = 0
    scan = Scan(points[:, :3].copy(), points[:, 3].copy())
    for suffix in (".npz", ".bin.gz", ".feather"):
        write_scan(tmp_path / f"scan{suffix}", scan)
        np.testing.assert_array_equal(read_scan(tmp_path / f"scan{suffix}").xyz, scan.xyz)
    empty = np.full((128, 2048, 4), np.nan, np.float32)  # a frame of a sensor that sees nothing
    np.savez_compressed(tmp_path / "empty.npz", points=empty)
    assert (tmp_path / "empty.npz").stat().st_size < empty.nbytes / 100
    assert len(read_scan(tmp_path / "empty.npz")) == 128 * 2048


def test_a_file_larger_than_any_scan_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "scan.bin"
    path.touch()
    os.truncate(path, LARGEST_SCAN + 16)
    with pytest.raises(InputError, match=r"1,073,741,840 bytes, more than 1,073,741,824"):
        read_content(path)


@pytest.mark.parametrize("suffix", [".bin", ".csv", ".npz.gz", ".label"])
def test_pipes_devices_and_folders_are_not_opened(tmp_path: Path, suffix: str) -> None:
    pipe, device, folder = (tmp_path / f"{kind}{suffix}" for kind in ("pipe", "device", "folder"))
    os.mkfifo(pipe)
    device.symlink_to("/dev/zero")
    folder.mkdir()
    for path in (pipe, device, folder):
        with pytest.raises(InputError, match=r"is a (pipe or a device|folder)"):
            read_labels(path, 3) if suffix == ".label" else read_scan(path)


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (PermissionError(), r"scan\.bin: cannot be read"),
        (MemoryError(), r"scan\.bin: needs more memory than there is"),
        (BrokenPipeError("of what is printed to"), "of what is printed to"),
    ],
)
def test_what_goes_wrong_while_a_file_is_read_is_its_fault_but_for_a_broken_pipe(
    error: Exception, reason: str
) -> None:
    kind = BrokenPipeError if isinstance(error, BrokenPipeError) else InputError
    with pytest.raises(kind, match=reason), reading(Path("scan.bin")):
        raise error
