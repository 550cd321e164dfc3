"""The faces of a mesh in a PLY file, renumbered where some of the vertices are taken away."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from derain.files.formats.ply.header import Element, Property, read_rows
from derain.files.text import filled_lines, format_rows

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
        return Faces(self.element, table, len(kept))

    def header(self) -> str:
        """The lines of the header that describe them."""
        return str(Element(self.element.name, len(self.table), self.element.properties))

    def to_bytes(self, encoding: str) -> bytes:
        """The faces as they stand in a file."""
        return format_rows(self.table) if encoding == "ascii" else self.table.tobytes()


def read_faces(
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
