"""Inputs of the fuzzer for each format of scan files, besides the files that derain writes."""

import io
import struct
import zipfile
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from random import Random

import numpy as np
from numpy.typing import ArrayLike

from benchmarks.fuzzing.mutations import damaged
from derain.evaluation.hard_cases import scene

# Points of every scan that is to be damaged.
POINTS = 40

# What a bomb unfolds to, MB: more than a reader may take.
BOMB = 1500


@dataclass(frozen=True)
class FormatInputs:
    """The inputs for one format.

    Attributes:
        hostile: Make the files that somebody thought out to stop or fill a process.
        by_others: Makes sound files such as other programs write.
        own_damage: Makes a damaged file by what is known of the format; None where nothing is.
    """

    hostile: Sequence[Callable[[], bytes]]
    by_others: Callable[[], Sequence[bytes]] = tuple
    own_damage: Callable[[Random], bytes] | None = None


def lines() -> bytes:
    """The points of a scan as lines of text: x, y, z and intensity."""
    file = io.BytesIO()
    np.savetxt(file, scene(POINTS), "%.6g")
    return file.getvalue()


def npy(array: ArrayLike) -> bytes:
    """An array as NumPy saves it."""
    file = io.BytesIO()
    np.save(file, np.asarray(array))
    return file.getvalue()


def deflated_zeros(start: bytes) -> bytes:
    """Raw deflated data that unfold to a start and then to zeros, by the same block repeated."""
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    head = packer.compress(start) + packer.flush(zlib.Z_FULL_FLUSH)
    block = packer.compress(bytes(10**6)) + packer.flush(zlib.Z_FULL_FLUSH)
    return head + block * BOMB + packer.flush()


# Rows of a Feather table of zeros, and the bytes of each of its columns.
_FEATHER_ROWS, _FEATHER_COLUMN = 1000, 4000


def _feather_bomb(compression: str) -> bytes:
    """A table whose compressed columns state gigabytes."""
    import pyarrow
    from pyarrow import feather

    zeros = np.zeros(_FEATHER_ROWS, np.float32)
    sink = pyarrow.BufferOutputStream()
    table = pyarrow.table(dict.fromkeys(("x", "y", "z", "intensity"), zeros))
    feather.write_feather(table, sink, compression)
    stated = struct.pack("<q", _FEATHER_COLUMN)
    assert stated in bytes(sink.getvalue())
    return bytes(sink.getvalue()).replace(stated, struct.pack("<q", BOMB * 10**6))


def _structured_npy() -> bytes:
    rows = np.zeros(POINTS, [("x", "<f4"), ("y", ">f4"), ("z", "<f8"), ("intensity", "u1")])
    for name, column in zip(rows.dtype.names or (), scene(POINTS).T, strict=True):
        rows[name] = column
    return npy(rows)


def _npy_header(shape: tuple[int, ...], kind: str) -> bytes:
    file = io.BytesIO()
    header = {"descr": kind, "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(file, header)
    return file.getvalue()


def _zip_bomb() -> bytes:
    """An .npz with one large array of zeros. Source: PKWARE, APPNOTE.TXT, section 4.3."""
    rows = BOMB * 10**6 // 16
    start = npy(np.zeros((0, 4), np.float32)).replace(b"(0, 4)", f"({rows}, 4)".encode())
    packed, name = deflated_zeros(start[: 128 - 10] + b" " * 9 + b"\n"), b"points.npy"
    sizes = struct.pack("<3I2H", 0, len(packed), BOMB * 10**6 + 128, len(name), 0)
    common = struct.pack("<5H", 20, 0, 8, 0, 0)
    local = b"PK\3\4" + common + sizes + name + packed
    central = b"PK\1\2" + b"\x14\0" + common + sizes + struct.pack("<3H2I", 0, 0, 0, 0, 0) + name
    return (
        local
        + central
        + struct.pack("<4s4H2IH", b"PK\5\6", 0, 0, 1, 1, len(central), len(local), 0)
    )


def _damaged_npz(generator: Random) -> bytes:
    columns = dict(zip(("x", "y", "z", "intensity"), scene(POINTS).T, strict=True))
    method = generator.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        for name, column in columns.items():
            content = npy(column)
            if generator.random() < 0.3:
                content = damaged(content, _structured_npy(), generator)
            # Without a date, so that the same draws give the same file.
            archive.writestr(zipfile.ZipInfo(f"{name}.npy"), content, method)
    return file.getvalue()


_PCD_HEADER = """\
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
    header = _PCD_HEADER.format(
        width=width, height=height, points=width * height, encoding=encoding
    )
    return header.encode() + data


def _compressed_pcd() -> bytes:
    columns = scene(POINTS).T.tobytes()
    # LZF with nothing but literal runs of 32 bytes.
    runs = [columns[start : start + 32] for start in range(0, len(columns), 32)]
    packed = b"".join(bytes([len(run) - 1]) + run for run in runs)
    sizes = struct.pack("<II", len(packed), len(columns))
    return _pcd("binary_compressed", sizes + packed)


def _pcd_bomb() -> bytes:
    # A zero, then copies of the 264 bytes before.
    copies = BOMB * 10**6 // 264
    packed = b"\0\0" + b"\xe0\xff\0" * copies
    size = (1 + 264 * copies) // 16 * 16
    sizes = struct.pack("<II", len(packed), size)
    return _pcd("binary_compressed", sizes + packed, size // 16)


def _pcd_of_many_values() -> bytes:
    header = _PCD_HEADER.format(width=1, height=1, points=1, encoding="ascii")
    return header.replace("COUNT 1 1 1 1", "COUNT 1 1 1 534231007").encode() + b"1 2 3 4\n"


PLY_ENCODINGS = ("ascii", "binary_little_endian", "binary_big_endian")


def _ply_header(encoding: str, points: int, faces: int, length: str = "uint") -> bytes:
    header = [
        "ply",
        f"format {encoding} 1.0",
        f"element vertex {points}",
        *(f"property float {name}" for name in ("x", "y", "z", "intensity")),
        *((f"element face {faces}", f"property list {length} int vertex_indices") if faces else ()),
        "end_header\n",
    ]
    return "\n".join(header).encode()


def _ply(encoding: str, faces: int) -> bytes:
    order = ">" if "big" in encoding else "<"
    vertices = scene(POINTS).astype(f"{order}f4").tobytes() if "binary" in encoding else lines()
    face = struct.pack(f"{order}B3i", 3, 0, 1, 2) if "binary" in encoding else b"3 0 1 2\n"
    return _ply_header(encoding, POINTS, faces, "uchar") + vertices + face * faces


# By suffix of the format.
INPUTS: dict[str, FormatInputs] = {
    ".bin": FormatInputs(
        # Numbers that overflow when they are squared, none at all, and half of a row.
        (
            np.full((POINTS, 4), np.finfo(np.float32).max).tobytes,
            np.full((POINTS, 4), np.nan, np.float32).tobytes,
            np.full((POINTS, 4), np.finfo(np.float64).max).tobytes,
            lambda: bytes(16 * POINTS + 8),
        ),
        lambda: [scene(POINTS).tobytes()],  # as KITTI's
    ),
    ".npy": FormatInputs(
        (
            # No rows, and columns that would fill the memory, were an array made of each.
            lambda: _npy_header((0, 10**9), "<f4"),
            lambda: _npy_header((10**12, 4), "<f4"),
            # Pickled objects, which may be programs.
            lambda: _npy_header((10**12,), "|O") + b"cos\nsystem\n(S'true'\ntR.",
        ),
        lambda: [npy(scene(POINTS)), npy(scene(POINTS).reshape(5, -1, 4)), _structured_npy()],
    ),
    ".npz": FormatInputs((_zip_bomb,), own_damage=_damaged_npz),
    ".pcd": FormatInputs(
        (_pcd_of_many_values, _pcd_bomb),
        lambda: [
            _pcd("ascii", lines()),
            _pcd("binary", scene(POINTS).tobytes(), POINTS // 4, 4),
            _compressed_pcd(),
        ],
    ),
    ".ply": FormatInputs(
        (
            # More vertices than a file can hold.
            lambda: _ply_header("ascii", 10**18, 0) + b"1 2 3 4\n",
            lambda: _ply_header("binary_big_endian", 10**18, 0) + bytes(16),
            # One vertex, and faces of which the first has two billion.
            lambda: (
                _ply_header("binary_little_endian", 1, 10**18) + bytes(16) + b"\xff\xff\xff\x7f"
            ),
        ),
        lambda: [_ply(encoding, faces) for encoding in PLY_ENCODINGS for faces in (0, 2)],
    ),
    ".feather": FormatInputs((partial(_feather_bomb, "lz4"), partial(_feather_bomb, "zstd"))),
}

_HOSTILE_TABLES: Sequence[Callable[[], bytes]] = (
    # Far too many columns, a number of a million digits, and a quote without an end.
    lambda: b"1," * 100_000 + b"1\n",
    lambda: b"x,y,z\n1,2," + b"9" * 10**6 + b"\n",
    lambda: b'x,y,z\n1,2,"3\n' + b"1,2,3\n" * 10_000,
)
INPUTS |= {suffix: FormatInputs(_HOSTILE_TABLES) for suffix in (".asc", ".txt", ".xyz")}
INPUTS[".csv"] = FormatInputs(
    _HOSTILE_TABLES,
    lambda: [  # as spreadsheets write them
        b"x,y,z,intensity\n" + lines().replace(b" ", b","),
        b'"x","y","z","name"\r\n1,2,3,4\r\n5,6,,8\r\n',
    ],
)
