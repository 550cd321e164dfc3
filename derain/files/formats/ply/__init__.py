"""Point clouds in the polygon file format (`.ply`): the vertices with all of their properties.

Source: Greg Turk, "The PLY Polygon File Format", version 1.0, Stanford University.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from derain.errors import InputError
from derain.files.columns import describable_columns, records, scan_of
from derain.files.content import Content
from derain.files.format import FORMATS, Format
from derain.files.formats.ply.faces import Faces, read_faces
from derain.files.formats.ply.header import (
    PROPERTY_TYPES,
    Element,
    Property,
    parse_header,
    read_rows,
)
from derain.files.reading import reading
from derain.files.text import encode, format_rows
from derain.scan import Scan


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
            *([faces.header()] if faces else []),
            "end_header",
        )
        data = format_rows(table) if header.encoding == "ascii" else table.tobytes()
        tail = faces.to_bytes(header.encoding) if faces else b""
        return encode("".join(f"{line}\n" for line in lines)) + data + tail


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
    faces = read_faces(behind[0], vertex.count, encoding, data, start) if behind else None
    others = before + (behind[1:] if faces else behind)
    left_out = tuple(element.name for element in others)
    return PlyHeader(encoding, comments, faces, left_out), table
