"""Point clouds in the Point Cloud Library's format (`.pcd`).

Source: Point Cloud Library, "The PCD (Point Cloud Data) file format", version 0.7,
https://pointclouds.org/documentation/tutorials/pcd_file_format.html, and
PointCloudLibrary/pcl:io/src/pcd_io.cpp, whose compressed data leave the padding out.
"""

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import lzf
import numpy as np

from derain.files.columns import describable_columns, records, scan_of
from derain.files.content import LARGEST_SCAN, MOST_COLUMNS, Content, MemoryBudget, check_columns
from derain.files.format import FORMATS, Format
from derain.files.text import LARGEST_HEADER, decode, encode, format_rows, parse_rows
from derain.scan import Array, Scan

ENCODINGS = ("ascii", "binary", "binary_compressed")
# TYPE and SIZE of every kind of value, in NumPy's spelling.
VALUE_TYPES = ("f4", "f8", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8")
# A column of this name fills a gap between others and means nothing.
PADDING = "_"

_DATA_LINE = re.compile(rb"^DATA[ \t]+(\w+)[ \t]*\r?(?:\n|\Z)", re.MULTILINE)


@dataclass(frozen=True)
class PcdHeader:
    """The header of a PCD file.

    Attributes:
        columns: Name and dtype of every column in the file's order, padding included; the dtype of
            a column of several values per point is a sub-array of shape (COUNT,).
        width: Points in a row of an organised cloud; of another cloud, all points.
        height: Rows of an organised cloud, else 1.
        points: Number of points; in a faulty file not width · height.
        encoding: One of ENCODINGS.
        viewpoint: Pose of the sensor as written, "tx ty tz qw qx qy qz".
    """

    columns: tuple[tuple[str, np.dtype[Any]], ...]
    width: int
    height: int
    points: int
    encoding: str = "binary"
    viewpoint: str = "0 0 0 1 0 0 0"

    @property
    def row(self) -> np.dtype[Any]:
        """One point; its fields are named by their place, because names (padding) may repeat."""
        return np.dtype([(str(place), dtype) for place, (_, dtype) in enumerate(self.columns)])

    def to_bytes(self) -> bytes:
        """The header as bytes of a file, DATA line included."""
        dtypes = [dtype for _, dtype in self.columns]
        lines = (
            "# .PCD v0.7 - Point Cloud Data file format",
            "VERSION 0.7",
            f"FIELDS {_join(name for name, _ in self.columns)}",
            f"SIZE {_join(dtype.base.itemsize for dtype in dtypes)}",
            f"TYPE {_join(dtype.base.kind.upper() for dtype in dtypes)}",
            f"COUNT {_join(math.prod(dtype.shape) for dtype in dtypes)}",
            f"WIDTH {self.width}",
            f"HEIGHT {self.height}",
            f"VIEWPOINT {self.viewpoint}",
            f"POINTS {self.points}",
            f"DATA {self.encoding}",
        )
        return encode("".join(f"{line}\n" for line in lines))


@FORMATS.add(".pcd")
class Pcd(Format):
    """Files of the Point Cloud Library, version 0.7, in all of their encodings."""

    HELP = "Point Cloud Library: ascii, binary or binary_compressed"

    def decode(self, content: Content, columns: Sequence[str]) -> Scan:
        """Reads a PCD file with every column it names.

        Args:
            content: The file, version 0.7: ascii, binary or binary_compressed.
            columns: Not used: a PCD names its columns.

        Returns:
            The scan; columns of several values per point are (N, COUNT), padding is left out.

        Raises:
            InputError: A file that is truncated or damaged, or has no coordinates.
        """
        header, data = _parse_header(content.data)
        fields = _columns_of(header, data, content.budget)
        points = len(next(iter(fields.values())))
        organised = header.height > 1 and header.width * header.height == points
        shape = (header.height, header.width) if organised else None
        return scan_of(content.path, fields, shape, header)

    def encode(self, path: Path, scan: Scan) -> bytes:
        """A scan's columns in the encoding and with the viewpoint of the PCD it came from.

        A scan from elsewhere becomes a binary PCD. Organised clouds stay organised.

        Raises:
            InputError: A column that no PCD can hold.
        """
        columns = describable_columns(path, scan, VALUE_TYPES)
        for name, column in columns.items():
            if column.ndim > 1:  # as (N, COUNT), because a PCD has no further axes
                columns[name] = column.reshape(len(column), math.prod(column.shape[1:]))
        dtypes = [
            np.dtype((column.dtype.newbyteorder("<"), column.shape[1:]))
            for column in columns.values()
        ]
        height, width = scan.shape or (1, len(scan))
        header = PcdHeader(tuple(zip(columns, dtypes, strict=True)), width, height, len(scan))
        if isinstance(scan.header, PcdHeader):
            header = replace(header, encoding=scan.header.encoding, viewpoint=scan.header.viewpoint)
        return header.to_bytes() + _data(header.encoding, records(columns, header.row))


def _parse_header(content: bytes) -> tuple[PcdHeader, bytes]:
    """Splits a file into its header and its data.

    Returns:
        The header, and the bytes after its last line.

    Raises:
        ValueError: A header that is missing, incomplete or contradictory.
    """
    end = _DATA_LINE.search(content, 0, LARGEST_HEADER)
    if end is None:
        raise ValueError("the header has no DATA line")
    lines = (line.split() for line in content[: end.start()].splitlines())
    entries = {decode(line[0]): [decode(word) for word in line[1:]] for line in lines if line}
    encoding = decode(end[1])
    if encoding not in ENCODINGS:
        raise ValueError(f"the header states DATA {encoding}")
    (width,) = _numbers("WIDTH", entries.get("WIDTH", []), length=1)
    (height,) = _numbers("HEIGHT", entries.get("HEIGHT", ["1"]), length=1)
    (points,) = _numbers("POINTS", entries.get("POINTS", [str(width * height)]), length=1)
    viewpoint = _join(entries.get("VIEWPOINT", [])) or PcdHeader.viewpoint
    header = PcdHeader(_stated_columns(entries), width, height, points, encoding, viewpoint)
    return header, content[end.end() :]


def _stated_columns(entries: dict[str, list[str]]) -> tuple[tuple[str, np.dtype[Any]], ...]:
    names = entries.get("FIELDS", [])
    check_columns(len(names))
    named = [name for name in names if name != PADDING]
    if not named or len(set(named)) < len(named):
        raise ValueError(f"the header states FIELDS {_join(names)}")
    types = entries.get("TYPE", [])
    sizes = _numbers("SIZE", entries.get("SIZE", []), len(names))
    counts = _numbers("COUNT", entries.get("COUNT", ["1"] * len(names)), len(names))
    if len(types) != len(names):
        raise ValueError(f"the header states TYPE {_join(types)} for {len(names)} fields")
    columns = []
    for name, kind, size, count in zip(names, types, sizes, counts, strict=True):
        value = f"{kind.lower()}{size}"
        if value not in VALUE_TYPES or not 0 < count <= LARGEST_SCAN // MOST_COLUMNS // size:
            raise ValueError(f"the header states TYPE {kind} SIZE {size} COUNT {count} for {name}")
        columns.append((name, np.dtype((f"<{value}", () if count == 1 else (count,)))))
    return tuple(columns)


def _numbers(key: str, words: list[str], length: int) -> list[int]:
    if len(words) != length or not all(word.isdecimal() for word in words):
        raise ValueError(f"the header states {key} {_join(words)}")
    return [int(word) for word in words]


def _join(words: Iterable[object]) -> str:
    return " ".join(map(str, words))


def _columns_of(header: PcdHeader, data: bytes, budget: MemoryBudget) -> dict[str, Array]:
    """The columns that the data of a file hold, without padding."""
    if header.encoding == "binary_compressed":
        return _decompressed_columns(header, data, budget)
    if header.encoding == "ascii":
        table, rest = parse_rows(data, header.row), 0
    else:
        points, rest = divmod(len(data), header.row.itemsize)
        table = np.frombuffer(data, header.row, points)
    _check_points(header, len(table), rest)
    return {
        name: table[str(place)] for place, (name, _) in enumerate(header.columns) if name != PADDING
    }


def _decompressed_columns(header: PcdHeader, data: bytes, budget: MemoryBudget) -> dict[str, Array]:
    """One column after the other, all of them compressed as one block."""
    compressed_size, size = np.frombuffer(data, "<u4", count=2).tolist()
    columns = tuple(column for column in header.columns if column[0] != PADDING)
    named = replace(header, columns=columns)
    if size == header.points * named.row.itemsize:  # no padding in the data
        header = named
    points, rest = divmod(size, header.row.itemsize)
    _check_points(header, points, rest)
    budget.reserve(size)
    plain = lzf.decompress(data[8 : 8 + compressed_size], size) if size else b""
    if plain is None or len(plain) != size:
        raise ValueError(f"the compressed data do not yield {size} bytes")
    fields, start = {}, 0
    for name, dtype in header.columns:
        values = np.frombuffer(plain, dtype.base, points * math.prod(dtype.shape), start)
        start += values.nbytes
        if name != PADDING:
            fields[name] = values.reshape(points, *dtype.shape)
    return fields


def _check_points(header: PcdHeader, points: int, rest: int) -> None:
    """Refuses data that are less than the header states, or too much to be whole points.

    A header may contradict itself (WIDTH · HEIGHT is not POINTS). One of the two numbers must then
    match the data. If the data have more whole points than either, all of them are read.
    """
    stated = {header.points, header.width * header.height}
    if points not in stated and (points < max(stated) or rest):
        raise ValueError(f"{points} points where the header states {max(stated)}")


def _data(encoding: str, table: Array) -> bytes:
    """The rows of a structured array (N,) as bytes of a file."""
    if encoding == "ascii":
        return format_rows(table)
    if encoding == "binary":
        return table.tobytes()
    plain = b"".join(table[name].tobytes() for name in table.dtype.names or ())
    # LZF makes incompressible data longer, by one byte in 32. It refuses to compress nothing.
    compressed = lzf.compress(plain, len(plain) * 17 // 16 + 64) or b""
    return np.array([len(compressed), len(plain)], "<u4").tobytes() + compressed
