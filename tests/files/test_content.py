"""Small files that claim or hold far more than any scan are refused before they take memory."""

import gzip
import io
import os
import struct
import tracemalloc
import zipfile
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pyarrow
import pytest

from benchmarks.fuzzing.formats import INPUTS
from derain import InputError, Scan
from derain.evaluation.hard_cases import scene
from derain.files import read_scan, write_scan
from derain.files.content import LARGEST_SCAN, SMALLEST_BUDGET, read_content
from derain.files.format import FORMATS
from derain.files.labels import read_labels
from derain.files.reading import reading

PCD = """\
VERSION .7
FIELDS x y z {names}
SIZE 4 4 4 {sizes}
TYPE F F F {types}
WIDTH {points}
HEIGHT 1
POINTS {points}
DATA {encoding}
"""


def pcd(data: bytes, encoding: str, points: int = 1, further: int = 0) -> bytes:
    """A file of coordinates, and of so many further columns of bytes."""
    names, sizes, types = (" ".join([word] * further) for word in ("_", "1", "U"))
    header = PCD.format(names=names, sizes=sizes, types=types, points=points, encoding=encoding)
    return header.encode() + data


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


# Zeros, which compress to next to nothing: more than a small file may expand to.
BOMB = 5 * 2**24
LZF = struct.pack("<II", 9, 2**32 - 16) + bytes(9)

# Besides what the fuzzer has for every format.
HOSTILE: dict[str, tuple[str, Callable[[], bytes], str]] = {
    "points": (".pcd", lambda: pcd(bytes(64), "binary", 10**18), "10{18}"),
    "columns": (".pcd", lambda: pcd(b"", "binary", 0, 2000), "2,003 columns"),
    "header": (".pcd", lambda: pcd(b"", "binary", 0, 10**6), "no DATA line"),
    "size": (".pcd", lambda: pcd(LZF, "binary_compressed", 2**28 - 1, 4), "room for"),
    "gzip": (".bin.gz", lambda: gzip.compress(bytes(BOMB), 1), "room for"),
    "zip that lies": (".npz", lying_npz, "CRC|header"),
    "zip members": (".npz", lambda: npz(**{f"a{n}": b"" for n in range(1100)}), "1,100 columns"),
    "repeated rows": (".npz", repeated_rows, "room for"),
    "item size": (".npy", lambda: npy((1,), [("x", "<f4", (2**28,))]), "bytes in the header"),
}
OF_THE_FUZZER = {
    f"{suffix} {number}": (suffix, make, "scan")
    for suffix in FORMATS
    for number, make in enumerate(INPUTS[suffix].hostile)
}
# Odd numbers, and faces that are left out.
READABLE = {".bin 0", ".bin 1", ".bin 2", ".ply 2"}


@pytest.mark.parametrize("name", HOSTILE | OF_THE_FUZZER)
def test_small_files_cannot_take_much_memory(tmp_path, name) -> None:
    suffix, content, reason = (HOSTILE | OF_THE_FUZZER)[name]
    path = tmp_path / f"scan{suffix}"
    path.write_bytes(content())
    tracemalloc.start()
    arrow = pyarrow.default_memory_pool()
    before = arrow.max_memory()
    try:
        with nullcontext() if name in READABLE else pytest.raises(InputError, match=reason):
            read_scan(path)
        assert tracemalloc.get_traced_memory()[1] < 2 * SMALLEST_BUDGET
        assert arrow.max_memory() == before
    finally:
        tracemalloc.stop()


def test_what_compresses_as_well_as_real_scans_and_better_is_read(tmp_path) -> None:
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


def test_a_file_larger_than_any_scan_is_not_read(tmp_path) -> None:
    path = tmp_path / "scan.bin"
    path.touch()
    os.truncate(path, LARGEST_SCAN + 16)
    with pytest.raises(InputError, match=r"1,073,741,840 bytes, more than 1,073,741,824"):
        read_content(path)


@pytest.mark.parametrize("suffix", [".bin", ".csv", ".npz.gz", ".label"])
def test_pipes_devices_and_folders_are_not_opened(tmp_path, suffix) -> None:
    pipe, device, folder = (tmp_path / f"{kind}{suffix}" for kind in ("pipe", "device", "folder"))
    os.mkfifo(pipe)
    device.symlink_to("/dev/zero")
    folder.mkdir()
    for path in (pipe, device, folder):
        with pytest.raises(InputError, match="is a folder, a pipe or a device"):
            read_labels(path, 3) if suffix == ".label" else read_scan(path)


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (PermissionError(), r"scan\.bin: cannot be read"),
        (MemoryError(), r"scan\.bin: needs more memory than is available"),
        (BrokenPipeError("of what is printed to"), "of what is printed to"),
    ],
)
def test_what_goes_wrong_while_a_file_is_read_is_its_fault_but_for_a_broken_pipe(
    error, reason
) -> None:
    kind = BrokenPipeError if isinstance(error, BrokenPipeError) else InputError
    with pytest.raises(kind, match=reason), reading(Path("scan.bin")):
        raise error
