"""Point clouds in the polygon file format (`.ply`): the vertices with all of their properties.

Source: Greg Turk, "The PLY Polygon File Format", version 1.0, Stanford University.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from derain.files.columns import describable_columns, no_place, records, scan_of
from derain.files.content import Content, check_columns
from derain.files.format import FORMATS, Format
from derain.files.text import LARGEST_HEADER, decode, encode, filled_lines, format_rows, parse_rows
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

# What programs call the list of a face's vertices.
_LISTS = ("vertex_indices", "vertex_index")


@dataclass(frozen=True)
class Property:
    """A column of an element.

    Attributes:
        name: Its name.
        kind: Type of its values, in NumPy's spelling.
        length: Type of the number of values, which comes before them in a list; None of one value.
    """

    name: str
    kind: str
    length: str | None = None

    def __str__(self) -> str:
        lists = "" if self.length is None else f"list {PROPERTY_TYPES[self.length]} "
        return f"property {lists}{PROPERTY_TYPES[self.kind]} {self.name}"


@dataclass(frozen=True)
class Element:
    """A table of the file: its name, its number of rows and its properties."""

    name: str
    count: int
    properties: list[Property]

    def __str__(self) -> str:
        return "\n".join((f"element {self.name} {self.count}", *map(str, self.properties)))

    def size(self, encoding: str) -> int:
        """Number of lines of text (ascii) or bytes (binary) of an element without lists."""
        return self.count * (1 if encoding == "ascii" else self.row(encoding).itemsize)

    def row(self, encoding: str, list_length: int | None = None) -> np.dtype[Any]:
        """Dtype of a row. A list has two fields: "length of <name>", and its values as <name>.

        Args:
            encoding: One of BYTE_ORDERS.
            list_length: Number of values of every list.

        Raises:
            ValueError: There is a list, and its length is not given.
        """
        order, columns = BYTE_ORDERS[encoding], list[tuple[Any, ...]]()
        for each in self.properties:
            if each.length is None:
                columns.append((each.name, order + each.kind))
            elif list_length is None:
                raise ValueError(f"the property {each.name} of {self.name} is a list")
            else:
                columns.append((f"length of {each.name}", order + each.length))
                columns.append((each.name, order + each.kind, (list_length,)))
        return np.dtype(columns)


@dataclass(frozen=True, eq=False)
class Faces:
    """Faces with the same number of vertices.

    Attributes:
        element: Their name, number and properties; the first property lists their vertices.
        table: A row for each face, structured (F,), as `Element.row` gives it.
        points: Number of vertices that they are numbered among.
    """

    element: Element
    table: Array
    points: int

    def take(self, rows: Array) -> "Faces":
        """The faces whose vertices all stay, renumbered.

        Args:
            rows: The vertices that stay: their numbers, or a bool mask. Of a vertex that is taken
                more than once, the faces keep the first.
        """
        kept = np.arange(self.points)[rows]
        number = np.full(self.points, -1)
        number[kept[::-1]] = np.arange(len(kept))[::-1]
        name = self.element.properties[0].name
        vertices = number[self.table[name]]
        stay = (vertices >= 0).all(axis=1)
        table = self.table[stay]
        table[name] = vertices[stay]
        return Faces(replace(self.element, count=len(table)), table, len(kept))


@dataclass(frozen=True)
class PlyHeader:
    """The content of a PLY file besides its vertices.

    Attributes:
        encoding: One of BYTE_ORDERS.
        comments: Lines of comments and object information, first word included.
        faces: Faces of the vertices, if there are any and if they can be renumbered.
        left_out: Names of the other elements, which are not written.
    """

    encoding: str = "binary_little_endian"
    comments: tuple[str, ...] = ()
    faces: Faces | None = None
    left_out: tuple[str, ...] = ()

    def take(self, rows: Array) -> "PlyHeader":
        """The header of a file of some of the vertices only."""
        return self if self.faces is None else replace(self, faces=self.faces.take(rows))


@FORMATS.add(".ply")
class Ply(Format):
    """Polygon files, version 1.0, in all of their encodings."""

    HELP = "polygon file: ascii or binary; its vertices, and the faces of a mesh"

    def decode(self, content: Content, columns: Sequence[str]) -> Scan:
        """Reads the vertices of a PLY file, and its faces if all have the same number of vertices.

        Args:
            content: The file, version 1.0: ascii or binary, of either byte order. Lists are
                understood only behind the vertices, where a mesh has its faces.
            columns: Not used: a PLY names its columns.

        Raises:
            InputError: A file that is truncated or damaged, or has no vertices with coordinates.
        """
        header, table = _parse(content.data)
        fields = {name: table[name] for name in table.dtype.names or ()}
        return scan_of(content.path, fields, header=header)

    def encode(self, path: Path, scan: Scan) -> bytes:
        """A scan's columns as vertices, encoded like the PLY it came from, else binary.

        Of other elements only faces are written, and of them those whose vertices are all there.

        Raises:
            InputError: A column that no PLY can hold.
        """
        columns = describable_columns(path, scan, PROPERTY_TYPES)
        for name, column in columns.items():
            if column.ndim > 1:
                raise no_place(path, name, column, "Write .pcd or .npz.")
        header = scan.header if isinstance(scan.header, PlyHeader) else PlyHeader()
        properties = [Property(name, column.dtype.str[1:]) for name, column in columns.items()]
        vertex = Element("vertex", len(scan), properties)
        table = records(columns, vertex.row(header.encoding))
        faces = header.faces if header.faces and header.faces.points == len(scan) else None
        lines = (
            "ply",
            f"format {header.encoding} 1.0",
            *header.comments,
            str(vertex),
            *([str(faces.element)] if faces else []),
            "end_header",
        )
        content = encode("".join(f"{line}\n" for line in lines))
        for rows in (table, *([faces.table] if faces else [])):
            content += format_rows(rows) if header.encoding == "ascii" else rows.tobytes()
        return content


def _parse(content: bytes) -> tuple[PlyHeader, Array]:
    """The content of a file besides its vertices, and the vertices, structured (N,)."""
    encoding, comments, elements, data = _parse_header(content)
    names = [element.name for element in elements]
    if "vertex" not in names:
        raise ValueError("no element named vertex")
    place = names.index("vertex")
    before, vertex, behind = elements[:place], elements[place], elements[place + 1 :]
    if not vertex.properties:
        raise ValueError("the vertices have no properties")
    start = sum(element.size(encoding) for element in before)
    table = _read_rows(data, encoding, vertex.row(encoding), start, vertex.count)
    start += vertex.size(encoding)
    faces = _read_faces(behind[0], vertex.count, encoding, data, start) if behind else None
    others = before + (behind[1:] if faces else behind)
    left_out = tuple(element.name for element in others)
    return PlyHeader(encoding, comments, faces, left_out), table


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
                elements[-1].properties.append(Property(name, _KINDS[kind]))
            case ["property", "list", length, kind, name] if {
                length,
                kind,
            } <= _KINDS.keys() and elements:
                elements[-1].properties.append(Property(name, _KINDS[kind], _KINDS[length]))
            case _:
                raise ValueError(f"'{line}' in the header")
    if not encoding:
        raise ValueError("no format in the header")
    check_columns(max((len(element.properties) for element in elements), default=0))
    return encoding, tuple(comments), elements, content[end.end() :]


def _read_rows(data: bytes, encoding: str, row: np.dtype[Any], start: int, count: int) -> Array:
    """Reads rows of an element.

    Args:
        data: Data of the file.
        encoding: Its encoding.
        row: Dtype of a row.
        start: Number of lines of text (ascii) or bytes (binary) before them.
        count: Number of rows.

    Raises:
        ValueError: There are fewer, or they are of another dtype.
    """
    if encoding == "ascii":
        table = parse_rows(data, row, start, count)
    else:
        found = max(len(data) - start, 0) // row.itemsize if row.itemsize else 0
        table = np.frombuffer(data, row, min(found, count), min(start, len(data)))
    if len(table) < count:
        raise ValueError(f"{len(table)} rows where the header states {count}")
    return table


def _read_faces(
    element: Element, points: int, encoding: str, data: bytes, start: int
) -> Faces | None:
    """Reads an element that may be faces.

    Args:
        element: Its name, properties and number of rows.
        points: Number of vertices.
        encoding: Encoding of the file.
        data: Data of the file.
        start: Number of lines of text or bytes before the element.

    Returns:
        The faces; None for something else, or for what cannot be renumbered: faces of unequal
        numbers of vertices, of vertices that are not there, whose vertices are not their first
        property, or cut off.
    """
    if not element.properties:
        return None
    vertices, *others = element.properties
    if vertices.name not in _LISTS or any(each.length for each in others):
        return None
    kinds = vertices.kind[0], (vertices.length or "")[:1]
    if not set(kinds) <= {"i", "u"}:  # whole numbers, and a whole number of them
        return None
    try:
        length = _first_length(element, encoding, data, start)
        if not 0 <= length <= len(data):
            return None
        table = _read_rows(data, encoding, element.row(encoding, length), start, element.count)
    except (ValueError, IndexError):
        return None
    alike = (table[f"length of {vertices.name}"] == length).all()
    there = ((table[vertices.name] >= 0) & (table[vertices.name] < points)).all()
    return Faces(element, table, points) if alike and there else None


def _first_length(element: Element, encoding: str, data: bytes, start: int) -> int:
    """Number of vertices of the first face."""
    if element.count == 0:
        return 0
    if encoding == "ascii":
        return int(next(filled_lines(data, start), b"").split()[0])
    length = f"{BYTE_ORDERS[encoding]}{element.properties[0].length}"
    return int(np.frombuffer(data, length, 1, start)[0])
