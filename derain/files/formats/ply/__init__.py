"""Point clouds in the polygon file format (`.ply`): the vertices with all of their properties.

Source: Greg Turk, "The PLY Polygon File Format", version 1.0, Stanford University.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from derain.errors import InputError
from derain.files.columns import describable_columns, records, scan_of
from derain.files.content import Content
from derain.files.format import FORMATS, Format
from derain.files.formats.ply.header import (
    PROPERTY_TYPES,
    Element,
    Property,
    parse_header,
    read_rows,
)
from derain.files.reading import reading
from derain.files.text import encode, filled_lines, format_rows
from derain.scan import Scan

# What programs call the list of a face's vertices.
_LISTS = ("vertex_indices", "vertex_index")


@dataclass(frozen=True, eq=False)
class Faces:
    """Faces that all have as many vertices.

    Attributes:
        element: What the header says of them.
        table: A row for each face, structured (F,), as `Element.row` gives it.
        points: Number of vertices that they are numbered among.
    """

    element: Element
    table: NDArray[Any]
    points: int

    def take(self, rows: NDArray[Any]) -> "Faces":
        """The faces whose vertices all stay, renumbered.

        Args:
            rows: The vertices that stay: their numbers, or a bool mask. Of a vertex that is taken
                more than once, the faces keep the first.
        """
        kept = np.arange(self.points)[rows]
        number = np.full(self.points, -1)
        number[kept[::-1]] = np.arange(len(kept))[::-1]
        name = self.element.lists[0].name
        vertices = number[self.table[name]]
        stay = (vertices >= 0).all(axis=1)
        table = self.table[stay]
        table[name] = vertices[stay]
        return Faces(replace(self.element, count=len(table)), table, len(kept))


@dataclass(frozen=True)
class PlyHeader:
    """What a PLY file says besides its vertices.

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

    def take(self, rows: NDArray[Any]) -> "PlyHeader":
        """The header of a file of some of the vertices only."""
        return self if self.faces is None else replace(self, faces=self.faces.take(rows))


@FORMATS.add(".ply")
class Ply(Format):
    """Polygon files, version 1.0, in all of their encodings."""

    HELP = "polygon file: ascii or binary; its vertices, and the faces of a mesh"

    def decode(self, content: Content, columns: Sequence[str]) -> Scan:
        """Reads the vertices of a PLY file, and its faces if all have as many vertices.

        Args:
            content: The file, version 1.0: ascii or binary, of either byte order. Lists are
                understood only behind the vertices, where a mesh has its faces.
            columns: Not used: a PLY names its columns.

        Raises:
            InputError: A file that is truncated or damaged, or has no vertices with coordinates.
        """
        with reading(content.path, ValueError):
            header, table = _parse(content.data)
        return scan_of(
            content.path, {name: table[name] for name in table.dtype.names or ()}, header=header
        )

    def encode(self, path: Path, scan: Scan) -> bytes:
        """A scan's columns as vertices, encoded like the PLY it came from, else binary.

        Of other elements only faces are written, and of them those whose vertices are all there.

        Raises:
            InputError: A column that no PLY can hold.
        """
        columns = describable_columns(path, scan, PROPERTY_TYPES)
        for name, column in columns.items():
            if column.ndim > 1:
                raise InputError(
                    path,
                    f"a vertex cannot hold the several values of '{name}'",
                    "Write .pcd or .npz.",
                )
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


def _parse(content: bytes) -> tuple[PlyHeader, NDArray[Any]]:
    """What a file says besides its vertices, and the vertices, structured (N,)."""
    encoding, comments, elements, data = parse_header(content)
    names = [element.name for element in elements]
    if "vertex" not in names:
        raise ValueError("no element named vertex")
    place = names.index("vertex")
    before, vertex, behind = elements[:place], elements[place], elements[place + 1 :]
    if not vertex.properties:
        raise ValueError("the vertices have no properties")
    start = sum(element.size(encoding) for element in before)
    table = read_rows(data, encoding, vertex.row(encoding), start, vertex.count)
    start += vertex.size(encoding)
    faces = _read_faces(behind[0], vertex.count, encoding, data, start) if behind else None
    others = before + (behind[1:] if faces else behind)
    left_out = tuple(element.name for element in others)
    return PlyHeader(encoding, comments, faces, left_out), table


def _read_faces(
    element: Element, points: int, encoding: str, data: bytes, start: int
) -> Faces | None:
    """Reads an element that may be faces.

    Args:
        element: What the header says of it.
        points: Number of vertices.
        encoding: Encoding of the file.
        data: Data of the file.
        start: Where the element begins: how many lines of text or bytes come before.

    Returns:
        The faces; None for something else, or for what cannot be renumbered: faces of unequal
        numbers of vertices, of vertices that are not there, or cut off.
    """
    if [each.name in _LISTS and _whole(each) for each in element.lists] != [True]:
        return None
    try:
        length = _first_length(element, encoding, data, start)
        if not 0 <= length <= len(data):
            return None
        table = read_rows(data, encoding, element.row(encoding, length), start, element.count)
    except (ValueError, IndexError):
        return None
    name = element.lists[0].name
    alike = (table[f"length of {name}"] == length).all()
    there = ((table[name] >= 0) & (table[name] < points)).all()
    return Faces(element, table, points) if alike and there else None


def _first_length(element: Element, encoding: str, data: bytes, start: int) -> int:
    """Number of vertices of the first face."""
    if element.count == 0:
        return 0
    place = element.properties.index(element.lists[0])
    if encoding == "ascii":
        return int(next(filled_lines(data, start), b"").split()[place])
    first = Element(element.name, 1, element.properties[:place])
    row = element.row(encoding, 0)
    return int(np.frombuffer(data, row[place], 1, start + first.row(encoding).itemsize)[0])


def _whole(property_: Property) -> bool:
    """Whether a list holds whole numbers, and a whole number of them."""
    return property_.kind[0] in "iu" and (property_.length or "")[0] in "iu"
