"""The header of a PCD file.

Source: Point Cloud Library, "The PCD (Point Cloud Data) file format", version 0.7,
https://pointclouds.org/documentation/tutorials/pcd_file_format.html
"""

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from derain.files.content import LARGEST_SCAN, MOST_COLUMNS, check_columns
from derain.files.text import LARGEST_HEADER, decode, encode

ENCODINGS = ("ascii", "binary", "binary_compressed")
# TYPE and SIZE of every kind of value, in NumPy's spelling.
VALUE_TYPES = ("f4", "f8", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8")
# A column of this name fills a gap between others and means nothing.
PADDING = "_"

_DATA_LINE = re.compile(rb"^DATA[ \t]+(\w+)[ \t]*\r?(?:\n|\Z)", re.MULTILINE)


@dataclass(frozen=True)
class PcdHeader:
    """What a PCD file says about its points.

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
        """The header as it stands in a file, DATA line included."""
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


def parse_header(content: bytes) -> tuple[PcdHeader, bytes]:
    """Splits a file into its header and its data.

    Returns:
        The header, and the bytes after its last line.

    Raises:
        ValueError: A header that is missing, incomplete or says what no PCD can mean.
    """
    end = _DATA_LINE.search(content, 0, LARGEST_HEADER)
    if end is None:
        raise ValueError("the header has no DATA line")
    lines = (line.split() for line in content[: end.start()].splitlines())
    entries = {decode(line[0]): [decode(word) for word in line[1:]] for line in lines if line}
    encoding = decode(end[1])
    if encoding not in ENCODINGS:
        raise ValueError(f"the header says DATA {encoding}")
    (width,) = _numbers("WIDTH", entries.get("WIDTH", []), length=1)
    (height,) = _numbers("HEIGHT", entries.get("HEIGHT", ["1"]), length=1)
    (points,) = _numbers("POINTS", entries.get("POINTS", [str(width * height)]), length=1)
    viewpoint = _join(entries.get("VIEWPOINT", [])) or PcdHeader.viewpoint
    header = PcdHeader(_columns(entries), width, height, points, encoding, viewpoint)
    return header, content[end.end() :]


def _columns(entries: dict[str, list[str]]) -> tuple[tuple[str, np.dtype[Any]], ...]:
    names = entries.get("FIELDS", [])
    check_columns(len(names))
    named = [name for name in names if name != PADDING]
    if not named or len(set(named)) < len(named):
        raise ValueError(f"the header says FIELDS {_join(names)}")
    types = entries.get("TYPE", [])
    sizes = _numbers("SIZE", entries.get("SIZE", []), len(names))
    counts = _numbers("COUNT", entries.get("COUNT", ["1"] * len(names)), len(names))
    if len(types) != len(names):
        raise ValueError(f"the header says TYPE {_join(types)} for {len(names)} fields")
    columns = []
    for name, kind, size, count in zip(names, types, sizes, counts, strict=True):
        value = f"{kind.lower()}{size}"
        if value not in VALUE_TYPES or not 0 < count <= LARGEST_SCAN // MOST_COLUMNS // size:
            raise ValueError(f"the header says TYPE {kind} SIZE {size} COUNT {count} for {name}")
        columns.append((name, np.dtype((f"<{value}", () if count == 1 else (count,)))))
    return tuple(columns)


def _numbers(key: str, words: list[str], length: int) -> list[int]:
    if len(words) != length or not all(word.isdecimal() for word in words):
        raise ValueError(f"the header says {key} {_join(words)}")
    return [int(word) for word in words]


def _join(words: Iterable[object]) -> str:
    return " ".join(map(str, words))
