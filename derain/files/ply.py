"""Point clouds in the polygon file format (`.ply`): the vertices with all of their properties.

Source: Greg Turk, "The PLY Polygon File Format", version 1.0, Stanford University.
"""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from derain.errors import InputError
from derain.files.atomic import replacing
from derain.files.columns import describable_columns, records, scan_of
from derain.files.reading import reading
from derain.files.text import decode, encode, format_rows, parse_rows
from derain.scan import Scan

BYTE_ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}

# Type names of the specification, which every program reads, by NumPy's.
_TYPES = {
    "i1": "char",
    "u1": "uchar",
    "i2": "short",
    "u2": "ushort",
    "i4": "int",
    "u4": "uint",
    "f4": "float",
    "f8": "double",
}
# Both those and the names that many programs write: int8, float32, ...
_KINDS = {
    **{name: kind for kind, name in _TYPES.items()},
    **{np.dtype(kind).name: kind for kind in _TYPES},
}
_END = re.compile(rb"^end_header[ \t]*\r?\n", re.MULTILINE)


@dataclass(frozen=True)
class PlyHeader:
    """What a PLY file says besides its vertices.

    Attributes:
        encoding: One of BYTE_ORDERS.
        comments: Lines of comments and object information, first word included.
    """

    encoding: str = "binary_little_endian"
    comments: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Element:
    """A table of the file: its name, its number of rows, and (name, type) of its properties.

    The type is None where the property is a list.
    """

    name: str
    count: int
    properties: list[tuple[str, str | None]]

    def row(self, encoding: str) -> np.dtype[Any]:
        columns = []
        for name, kind in self.properties:
            if kind is None:
                raise ValueError(f"the property {name} of {self.name} is a list")
            columns.append((name, BYTE_ORDERS[encoding] + kind))
        return np.dtype(columns)


def read_ply(path: Path) -> Scan:
    """Reads the vertices of a PLY file.

    Args:
        path: The file, version 1.0: ascii or binary, of either byte order. Lists are understood
            only behind the vertices, where a mesh has its faces.

    Raises:
        InputError: A file that cannot be read, is truncated or damaged, or has no vertices with
            coordinates.
    """
    with reading(path, ValueError):
        content = path.read_bytes()
        header, elements, start = _parse_header(content)
        names = [element.name for element in elements]
        if "vertex" not in names:
            raise ValueError("no element named vertex")
        before = elements[: names.index("vertex")]
        table = _rows(header, before, elements[len(before)], content[start:])
    return scan_of(path, {name: table[name] for name in table.dtype.names or ()}, header=header)


def write_ply(path: Path, scan: Scan) -> None:
    """Writes a scan's columns as vertices, encoded like the PLY it came from, else binary.

    Elements other than the vertices are left out: the faces of points that are gone mean nothing.

    Raises:
        InputError: A column that no PLY can hold, or a file that cannot be written.
    """
    columns = describable_columns(path, scan, _TYPES)
    for name, column in columns.items():
        if column.ndim > 1:
            raise InputError(
                path, f"a vertex cannot hold the several values of '{name}'", "Write .pcd or .npz."
            )
    header = scan.header if isinstance(scan.header, PlyHeader) else PlyHeader()
    kinds = [(name, column.dtype.str[1:]) for name, column in columns.items()]
    row = _Element("vertex", len(scan), [*kinds]).row(header.encoding)
    table = records(columns, row)
    lines = (
        "ply",
        f"format {header.encoding} 1.0",
        *header.comments,
        f"element vertex {len(scan)}",
        *(f"property {_TYPES[kind]} {name}" for name, kind in kinds),
        "end_header",
    )
    data = format_rows(table) if header.encoding == "ascii" else table.tobytes()
    with replacing(path) as temporary:
        temporary.write_bytes(encode("".join(f"{line}\n" for line in lines)) + data)


def _parse_header(content: bytes) -> tuple[PlyHeader, list[_Element], int]:
    """The header, the elements in the file's order, and where the data begin."""
    end = _END.search(content)
    if end is None or not content.startswith(b"ply"):
        raise ValueError("no PLY header")
    encoding, comments, elements = "", [], list[_Element]()
    for line in map(decode, content[: end.start()].splitlines()[1:]):
        match line.split():
            case ["comment" | "obj_info", *_]:
                comments.append(line)
            case ["format", word, "1.0"] if word in BYTE_ORDERS:
                encoding = word
            case ["element", name, count] if count.isdecimal():
                elements.append(_Element(name, int(count), []))
            case ["property", kind, name] if kind in _KINDS and elements:
                elements[-1].properties.append((name, _KINDS[kind]))
            case ["property", "list", _, _, name] if elements:
                elements[-1].properties.append((name, None))
            case _:
                raise ValueError(f"'{line}' in the header")
    if not encoding:
        raise ValueError("no format in the header")
    return PlyHeader(encoding, tuple(comments)), elements, end.end()


def _rows(header: PlyHeader, before: list[_Element], vertex: _Element, data: bytes) -> NDArray[Any]:
    row = vertex.row(header.encoding)
    if not vertex.properties:
        raise ValueError("the vertices have no properties")
    if header.encoding == "ascii":
        start = sum(element.count for element in before)
        table = parse_rows(data, row, slice(start, start + vertex.count))
    else:
        start = sum(element.count * element.row(header.encoding).itemsize for element in before)
        data = data[start:]
        table = np.frombuffer(data, row, min(len(data) // row.itemsize, vertex.count))
    if len(table) < vertex.count:
        raise ValueError(f"{len(table)} vertices where the header states {vertex.count}")
    return table
