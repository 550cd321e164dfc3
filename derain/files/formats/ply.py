"""Point clouds in the polygon file format (`.ply`): the vertices with all of their properties.

Source: Greg Turk, "The PLY Polygon File Format", version 1.0, Stanford University.
"""

import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from derain.files.columns import describable_columns, no_place, records, scan_of
from derain.files.content import Content, check_columns
from derain.files.format import FORMATS, Format
from derain.files.text import LARGEST_HEADER, decode, encode, format_rows, parse_rows
from derain.scan import Array, Scan

BYTE_ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}

# Type names of the specification, which every program reads, by NumPy's.
PROPERTY_TYPES = {
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
    **{name: kind for kind, name in PROPERTY_TYPES.items()},
    **{np.dtype(kind).name: kind for kind in PROPERTY_TYPES},
}
_END = re.compile(rb"^end_header[ \t]*\r?\n", re.MULTILINE)


@dataclass(frozen=True)
class Element:
    """A table of the file.

    Attributes:
        name: Its name.
        count: Number of its rows.
        properties: Name and type of its columns, in NumPy's spelling; None for a list, which the
            vertices may not have.
    """

    name: str
    count: int
    properties: list[tuple[str, str | None]]

    def row(self, encoding: str) -> np.dtype[Any]:
        """Dtype of a row.

        Args:
            encoding: One of BYTE_ORDERS.

        Raises:
            ValueError: There is a list.
        """
        if any(kind is None for _, kind in self.properties):
            raise ValueError(f"a property of {self.name} is a list")
        order = BYTE_ORDERS[encoding]
        return np.dtype([(name, f"{order}{kind}") for name, kind in self.properties])


@dataclass(frozen=True)
class PlyHeader:
    """The content of a PLY file besides its vertices.

    Attributes:
        encoding: One of BYTE_ORDERS.
        comments: Lines of comments and object information, first word included.
        left_out: Names of the other elements with rows, such as faces, which are not written.
    """

    encoding: str = "binary_little_endian"
    comments: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()


@FORMATS.add(".ply")
class Ply(Format):
    """Polygon files, version 1.0, in all of their encodings."""

    HELP = "polygon file: ascii or binary; its vertices"

    def decode(self, content: Content, columns: Sequence[str]) -> Scan:
        """Reads the vertices of a PLY file.

        Args:
            content: The file, version 1.0: ascii or binary, of either byte order. The vertices
                are its first element.
            columns: Not used: a PLY names its columns.

        Raises:
            InputError: A file that is truncated or damaged, or has no vertices with coordinates.
        """
        header, table = _parse(content.data)
        fields = {name: table[name] for name in table.dtype.names or ()}
        return scan_of(content.path, fields, header=header)

    def encode(self, path: Path, scan: Scan) -> bytes:
        """A scan's columns as vertices, encoded like the PLY it came from, else binary.

        Other elements are not written.

        Raises:
            InputError: A column that no PLY can hold.
        """
        columns = describable_columns(path, scan, PROPERTY_TYPES)
        for name, column in columns.items():
            if column.ndim > 1:
                raise no_place(path, name, column, "Write .pcd or .npz.")
        header = scan.header if isinstance(scan.header, PlyHeader) else PlyHeader()
        kinds = {name: column.dtype.str[1:] for name, column in columns.items()}
        vertex = Element("vertex", len(scan), [*kinds.items()])
        table = records(columns, vertex.row(header.encoding))
        lines = (
            "ply",
            f"format {header.encoding} 1.0",
            *header.comments,
            f"element vertex {len(scan)}",
            *(f"property {PROPERTY_TYPES[kind]} {name}" for name, kind in kinds.items()),
            "end_header",
        )
        rows = format_rows(table) if header.encoding == "ascii" else table.tobytes()
        return encode("".join(f"{line}\n" for line in lines)) + rows


def _parse(content: bytes) -> tuple[PlyHeader, Array]:
    """The content of a file besides its vertices, and the vertices, structured (N,)."""
    encoding, comments, elements, data = _parse_header(content)
    if not elements or elements[0].name != "vertex":
        raise ValueError("its first element is not vertex")
    vertex, *others = elements
    if not vertex.properties:
        raise ValueError("the vertices have no properties")
    row = vertex.row(encoding)
    if encoding == "ascii":
        table = parse_rows(data, row, min(vertex.count, sys.maxsize))
    else:
        table = np.frombuffer(data, row, min(len(data) // row.itemsize, vertex.count))
    if len(table) < vertex.count:
        raise ValueError(f"{len(table)} rows where the header states {vertex.count}")
    left_out = tuple(element.name for element in others if element.count)
    return PlyHeader(encoding, comments, left_out), table


def _parse_header(content: bytes) -> tuple[str, tuple[str, ...], list[Element], bytes]:
    """The parts of a file's header.

    Returns:
        The encoding; lines of comments and object information; the elements in the file's order;
        and the data behind it.

    Raises:
        ValueError: A header that is missing, incomplete or contradictory.
    """
    end = _END.search(content, 0, LARGEST_HEADER)
    if end is None or not content.startswith(b"ply"):
        raise ValueError("no PLY header")
    encoding, comments, elements = "", [], list[Element]()
    for line in map(decode, content[: end.start()].splitlines()[1:]):
        match line.split():
            case ["comment" | "obj_info", *_]:
                comments.append(line)
            case ["format", word, "1.0"] if word in BYTE_ORDERS:
                encoding = word
            case ["element", name, count] if count.isdecimal():
                elements.append(Element(name, int(count), []))
            case ["property", kind, name] if kind in _KINDS and elements:
                elements[-1].properties.append((name, _KINDS[kind]))
            case ["property", "list", _, _, name] if elements:
                elements[-1].properties.append((name, None))
            case _:
                raise ValueError(f"'{line}' in the header")
    if not encoding:
        raise ValueError("no format in the header")
    check_columns(max((len(element.properties) for element in elements), default=0))
    return encoding, tuple(comments), elements, content[end.end() :]
