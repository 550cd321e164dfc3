"""Scan files of every format that derain reads, and labels."""

import gzip
import io
import struct
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Sequence
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from random import Random

import numpy as np

from benchmarks.fuzzing.mutations import damaged
from benchmarks.fuzzing.reader import Reader
from derain import files
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.files.format import FORMATS
from derain.files.labels import read_labels, semantic
from derain.scan import Scan

POINTS = 40

# What a bomb unfolds to, MB: more than a reader may take.
BOMB = 1500


def readers() -> list[Reader]:
    """One for each format, those of compressed files included, and one for labels."""
    # A format whose library is not installed can be neither written nor read.
    formats = [reader for reader in map(_reader, FORMATS) if reader.seeds()]
    packed = [_packed(reader) for reader in formats if reader.file in ("scan.bin", "scan.ply")]
    labels = Reader("label", "scan.label", _read_labels, lambda: [bytes(range(4 * POINTS))])
    return [*formats, *packed, labels]


def _reader(suffix: str) -> Reader:
    change = _npz if suffix == ".npz" else None
    hostile = _HOSTILE.get(suffix, ())
    return Reader(suffix[1:], f"scan{suffix}", _read_scan, lambda: _seeds(suffix), hostile, change)


def _packed(reader: Reader) -> Reader:
    """The same format within gzip, its content and its wrapping damaged by turns."""

    def change(draw: Random) -> bytes:
        seeds = reader.seeds()
        return gzip.compress(damaged(draw.choice(seeds), draw.choice(seeds), draw), 1, mtime=0)

    def seeds() -> list[bytes]:
        return [gzip.compress(content, mtime=0) for content in reader.seeds()]

    return Reader(
        f"{reader.name}.gz", f"{reader.file}.gz", _read_scan, seeds, (_gzip_bomb,), change
    )


def _read_scan(path: Path) -> None:
    scan = files.read_scan(path)
    count = len(scan)
    assert scan.xyz.dtype == np.float32, scan.xyz.dtype
    assert scan.xyz.shape == (count, 3), scan.xyz.shape
    if scan.intensity is not None:
        assert scan.intensity.dtype == np.float32, scan.intensity.dtype
        assert scan.intensity.shape == (count,), scan.intensity.shape
    for name, column in scan.fields.items():
        assert len(column) == count, f"{name!r} has {len(column)} rows of {count}"
    if scan.shape is not None:
        assert scan.shape[0] * scan.shape[1] == count, scan.shape
    assert scan.valid.shape == (count,)
    assert np.isfinite(scan.range[scan.valid]).all()


def _read_labels(path: Path) -> None:
    ids = semantic(read_labels(path, POINTS))
    assert ids.shape == (POINTS,)
    assert 0 <= ids.min() <= ids.max() <= 0xFFFF


def _seeds(suffix: str) -> list[bytes]:
    """Files that derain writes, and such as others write."""
    return [*_written(suffix), *(make() for make in _BY_OTHERS.get(suffix, ()))]


def _written(suffix: str) -> list[bytes]:
    points = scene(POINTS)
    columns = dict(zip(("x", "y", "z", "intensity"), points.T, strict=True))
    more = {"ring": np.arange(POINTS, dtype=np.uint16), "time": np.linspace(0, 0.1, POINTS)}
    contents = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"scan{suffix}"
        for fields in ({}, columns, columns | more):
            try:
                files.write_scan(
                    path, Scan(points[:, :3].copy(), points[:, 3].copy(), fields=fields)
                )
                files.read_scan(path)
            except InputError:  # a format that cannot hold these columns, or is only read
                continue
            contents.append(path.read_bytes())
    return contents


def _npy(array: "np.typing.ArrayLike") -> bytes:
    file = io.BytesIO()
    np.save(file, np.asarray(array))
    return file.getvalue()


def _structured() -> bytes:
    rows = np.zeros(POINTS, [("x", "<f4"), ("y", ">f4"), ("z", "<f8"), ("intensity", "u1")])
    for name, column in zip(rows.dtype.names or (), scene(POINTS).T, strict=True):
        rows[name] = column
    return _npy(rows)


def _npz(draw: Random) -> bytes:
    """Arrays that are damaged one by one, in a sound archive."""
    columns = dict(zip(("x", "y", "z", "intensity"), scene(POINTS).T, strict=True))
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", draw.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))) as out:
        for name, column in columns.items():
            content = _npy(column)
            odd = damaged(content, _structured(), draw) if draw.random() < 0.3 else content
            out.writestr(f"{name}.npy", odd)
    return file.getvalue()


_HEADER = """\
# .PCD v0.7 - Point Cloud Data file format
VERSION 0.7
FIELDS x y z intensity
SIZE 4 4 4 4
TYPE F F F F
COUNT 1 1 1 1
WIDTH {width}
HEIGHT {height}
VIEWPOINT 0 0 0 1 0 0 0
POINTS {points}
DATA {encoding}
"""


def _pcd(encoding: str, data: bytes, width: int = POINTS, height: int = 1) -> bytes:
    header = _HEADER.format(width=width, height=height, points=width * height, encoding=encoding)
    return header.encode() + data


def _lines() -> bytes:
    file = io.BytesIO()
    np.savetxt(file, scene(POINTS), "%.6g")
    return file.getvalue()


def _compressed_pcd() -> bytes:
    columns = scene(POINTS).T.tobytes()
    # LZF with nothing but literal runs of 32 bytes.
    runs = [columns[start : start + 32] for start in range(0, len(columns), 32)]
    packed = b"".join(bytes([len(run) - 1]) + run for run in runs)
    sizes = struct.pack("<II", len(packed), len(columns))
    return _pcd("binary_compressed", sizes + packed)


def _lzf_bomb() -> bytes:
    # A zero, then copies of the 264 bytes before.
    copies = BOMB * 10**6 // 264
    packed = b"\0\0" + b"\xe0\xff\0" * copies
    size = (1 + 264 * copies) // 16 * 16
    sizes = struct.pack("<II", len(packed), size)
    return _pcd("binary_compressed", sizes + packed, size // 16)


def _pcd_of_many_counts() -> bytes:
    header = _HEADER.format(width=1, height=1, points=1, encoding="ascii")
    return header.replace("COUNT 1 1 1 1", "COUNT 1 1 1 534231007").encode() + b"1 2 3 4\n"


def _ply(encoding: str, faces: bool) -> bytes:
    points = scene(POINTS)
    order = ">" if "big" in encoding else "<"
    header = [
        "ply",
        f"format {encoding} 1.0",
        f"element vertex {POINTS}",
        *(f"property float {name}" for name in ("x", "y", "z", "intensity")),
        *(("element face 2", "property list uchar int vertex_indices") if faces else ()),
        "end_header\n",
    ]
    vertices = points.astype(f"{order}f4").tobytes() if "binary" in encoding else _lines()
    face = struct.pack(f"{order}B3i", 3, 0, 1, 2) if "binary" in encoding else b"3 0 1 2\n"
    return "\n".join(header).encode() + vertices + face * 2 * faces


def _zeros(start: bytes) -> bytes:
    """Raw deflated data that unfold to a start and then to zeros, by the same block repeated."""
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    head = packer.compress(start) + packer.flush(zlib.Z_FULL_FLUSH)
    block = packer.compress(bytes(10**6)) + packer.flush(zlib.Z_FULL_FLUSH)
    return head + block * BOMB + packer.flush()


def _gzip_bomb() -> bytes:
    return b"\x1f\x8b\x08\0\0\0\0\0\0\x03" + _zeros(b"") + bytes(8)


def _zip_bomb() -> bytes:
    """An .npz with one large array of zeros. Source: PKWARE, APPNOTE.TXT, section 4.3."""
    rows = BOMB * 10**6 // 16
    start = _npy(np.zeros((0, 4), np.float32)).replace(b"(0, 4)", f"({rows}, 4)".encode())
    packed, name = _zeros(start[: 128 - 10] + b" " * 9 + b"\n"), b"points.npy"
    sizes = struct.pack("<3I2H", 0, len(packed), BOMB * 10**6 + 128, len(name), 0)
    common = struct.pack("<5H", 20, 0, 8, 0, 0)
    local = b"PK\3\4" + common + sizes + name + packed
    central = b"PK\1\2" + b"\x14\0" + common + sizes + struct.pack("<3H2I", 0, 0, 0, 0, 0) + name
    return (
        local
        + central
        + struct.pack("<4s4H2IH", b"PK\5\6", 0, 0, 1, 1, len(central), len(local), 0)
    )


def _las(compressed: bool, version: str) -> bytes:
    import laspy

    header = laspy.LasHeader(version=version, point_format=7 if version == "1.4" else 3)
    header.offsets, header.scales = np.array([4e5, 5e6, 0]), np.full(3, 0.001)
    las = laspy.LasData(header)
    points = scene(POINTS)
    las.xyz = points[:, :3] + header.offsets
    las.intensity = points[:, 3].astype(np.uint16)
    file = io.BytesIO()
    las.write(file, do_compress=compressed)
    return file.getvalue()


_LAS_VERSIONS = ("1.2", "1.4") if find_spec("laspy") else ()

_BY_OTHERS: dict[str, Sequence[Callable[[], bytes]]] = {
    ".bin": (lambda: scene(POINTS).tobytes(),),
    ".npy": (
        lambda: _npy(scene(POINTS)),
        lambda: _npy(scene(POINTS).reshape(5, -1, 4)),
        _structured,
    ),
    ".npz": (),
    ".pcd": (
        lambda: _pcd("ascii", _lines()),
        lambda: _pcd("binary", scene(POINTS).tobytes(), POINTS // 4, 4),
        _compressed_pcd,
    ),
    ".ply": tuple(
        lambda encoding=encoding, faces=faces: _ply(encoding, faces)
        for encoding in ("ascii", "binary_little_endian", "binary_big_endian")
        for faces in (False, True)
    ),
    ".csv": (
        lambda: b"x,y,z,intensity\n" + _lines().replace(b" ", b","),
        lambda: b'"x","y","z","name"\r\n1,2,3,4\r\n5,6,,8\r\n',
    ),
    ".las": [partial(_las, False, version) for version in _LAS_VERSIONS],
    ".laz": [partial(_las, True, version) for version in _LAS_VERSIONS],
}


def _columns_of_nothing() -> bytes:
    """An array of no rows and of columns that would fill the memory, were each of them made."""
    file = io.BytesIO()
    header = {"descr": "<f4", "fortran_order": False, "shape": (0, 10**9)}
    np.lib.format.write_array_header_1_0(file, header)
    return file.getvalue()


_HOSTILE: dict[str, Sequence[Callable[[], bytes]]] = {
    ".pcd": (_pcd_of_many_counts, _lzf_bomb),
    ".npy": (_columns_of_nothing,),
    ".npz": (_zip_bomb,),
}
