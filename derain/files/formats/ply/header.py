"""The header of a PLY file: its elements and their properties.

Source: Greg Turk, "The PLY Polygon File Format", version 1.0, Stanford University.
"""

import re
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from derain.files.content import check_columns
from derain.files.text import LARGEST_HEADER, decode, parse_rows

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
        """How many lines of text (ascii) or bytes (binary) an element without lists takes."""
        return self.count * (1 if encoding == "ascii" else self.row(encoding).itemsize)

    @property
    def lists(self) -> list[Property]:
        """The properties that hold a list for each row."""
        return [each for each in self.properties if each.length is not None]

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


def parse_header(content: bytes) -> tuple[str, tuple[str, ...], list[Element], bytes]:
    """What the header of a file says.

    Returns:
        The encoding; lines of comments and object information; the elements in the file's order;
        and the data behind it.

    Raises:
        ValueError: A header that is missing, incomplete or says what no PLY can mean.
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


def read_rows(
    data: bytes, encoding: str, row: np.dtype[Any], start: int, count: int
) -> NDArray[Any]:
    """Reads rows of an element.

    Args:
        data: Data of the file.
        encoding: Its encoding.
        row: Dtype of a row.
        start: Where they begin: how many lines of text (ascii) or bytes (binary) come before.
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
