"""Points as lines of text (`.csv`, `.txt`, `.xyz`, `.asc`); REHEARSE-3D's extended radar.

Source: Y. Shafranovich, "Common Format and MIME Type for Comma-Separated Values (CSV) Files",
RFC 4180.
"""

import csv
import io
import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import chain, islice
from pathlib import Path

import numpy as np

from derain.files.columns import Columns, columns_of, name_columns, no_place, scan_of
from derain.files.content import Content, check_columns
from derain.files.format import FORMATS, Format
from derain.files.names import scan_suffix
from derain.files.text import BYTE_ORDER_MARK, Line, decode, encode, filled_lines
from derain.scan import Array, Ints, Scan

# What some programs put before the line of names.
_COMMENT = re.compile(r"\s*(#|//)")

# Lines that are held as text at a time, which takes ten times the memory of their numbers.
_CHUNK = 4096


@dataclass(frozen=True, eq=False)
class TableHeader:
    """A table as it was written.

    Attributes:
        separator: Separator of the values of a line; None for white space.
        named: True if a line of the file names the columns.
        text: The whole file.
        rows: Place of each point's line among those that are not empty, int64 (N,).
        columns: Name → numbers of these lines, (N,).
    """

    separator: str | None
    named: bool
    text: bytes
    rows: Ints
    columns: Columns

    def take(self, rows: Array) -> "TableHeader":
        """The table of some of the points only."""
        columns = {name: column[rows] for name, column in self.columns.items()}
        return replace(self, rows=self.rows[rows], columns=columns)

    def holds(self, columns: Columns) -> bool:
        """True if the lines hold just these columns, with these numbers."""
        return tuple(columns) == tuple(self.columns) and all(
            np.array_equal(ours, theirs, equal_nan=True)
            for ours, theirs in zip(self.columns.values(), columns.values(), strict=True)
        )

    def lines(self) -> bytes:
        """The line of names, if there is one, and the lines of the points, as they were written."""
        newline = b"\r\n" if b"\r\n" in self.text else b"\n"
        lines = [line for _, line in filled_lines(self.text)]
        rows = [*range(self.named), *self.rows.tolist()]
        return b"".join(lines[row] + newline for row in rows)


@FORMATS.add(".csv", ".txt", ".asc", ".xyz")
class Table(Format):
    """Lines of numbers, perhaps under a line of names."""

    HELP = "lines of numbers, optionally after a line of names"
    DAMAGE = (ValueError, csv.Error)

    def decode(self, content: Content, columns: Sequence[str]) -> Scan:
        """Reads a table of points.

        Args:
            content: The file: a line of names, which may begin with # or //, if there is one, then
                one line a point, empty lines aside. Values are separated by commas if there is one
                in the first line, else by semicolons, else by white space. They may be in quotes;
                an empty one is NaN.
            columns: Names of the columns of a file without a line of names.

        Returns:
            The scan. Columns of whole numbers, written without a point, are int64 (uint64 if only
            that holds them), all others float64. A file of names alone, or an empty one, is a scan
            of zero points.

        Raises:
            InputError: A file that has lines of different lengths or values that are not numbers,
                names two columns alike, or has no coordinates.
        """
        path, header = content.path, _parse_table(content.data)
        if header.named:
            return scan_of(path, header.columns, header=header)
        numbers = list(header.columns.values()) or [np.empty(0)] * len(columns)
        fields = name_columns(path, numbers, columns)
        return scan_of(path, fields, header=replace(header, columns=fields))

    def encode(self, path: Path, scan: Scan) -> bytes:
        """A scan's columns as text.

        Lines that the scan comes from are written as they were. Where its columns are others, every
        number has as many digits as give it back: in the types that `decode` states, separated as
        in the table that the scan came from, else by commas in a .csv and by spaces in other files.

        Raises:
            InputError: A column that no table can hold.
        """
        columns = columns_of(scan)
        header = scan.header if isinstance(scan.header, TableHeader) else None
        if header is not None and header.holds(columns):
            return header.lines()
        separator = header.separator if header else "," if scan_suffix(path) == ".csv" else None
        for name, column in columns.items():
            _refuse_unreadable(path, name, column, separator)
        values = [
            (column.astype(np.uint8) if column.dtype == bool else column).tolist()
            for column in columns.values()
        ]
        text = io.StringIO()
        writer = csv.writer(text, delimiter=separator or " ", lineterminator="\n")
        if header is None or header.named or tuple(header.columns) != tuple(columns):
            writer.writerow(columns)
        writer.writerows(zip(*values, strict=True))
        return encode(text.getvalue())


def _refuse_unreadable(path: Path, name: str, column: Array, separator: str | None) -> None:
    """Refuses a column that could not be read again as it was."""
    one_line = name == name.strip() and len(name.splitlines()) < 2
    one_word = separator is not None or not set(name) & set(",; \t\"'")
    no_comment = not name.startswith(("#", "//"))
    number = column.dtype.kind in "biuf" and column.dtype.itemsize <= 8
    if not (one_line and one_word and no_comment and number) or column.ndim > 1:
        raise no_place(path, name, column)


def _parse_table(text: bytes) -> TableHeader:
    """Reads lines of numbers; empty lines are skipped.

    The first line names the columns if any of its values is no number; otherwise they are called by
    their places.

    Raises:
        ValueError: Lines of different lengths, values that are not numbers, or two columns of one
            name.
        csv.Error: Quotes that do not match.
    """
    lines = filled_lines(text)
    number, line = next(lines, (0, None))
    if line is None:
        return TableHeader(",", False, text, np.empty(0, np.int64), {})
    first = decode(line.removeprefix(BYTE_ORDER_MARK))
    separator = next((each for each in ",;" if each in first), None)
    (values,) = _rows([_COMMENT.sub("", first)], separator)
    check_columns(len(values))
    named = not all(map(_is_number, values))
    if named:
        titles = [name.strip() for name in values]
        if len(set(titles)) < len(titles):
            raise ValueError(f"line {number} names two columns alike: {', '.join(titles)}")
    else:
        titles = [f"column {place}" for place, _ in enumerate(values, 1)]
        lines = chain([(number, encode(first))], lines)
    numbers = _parse_lines(lines, separator, titles)
    rows = np.arange(len(numbers[0])) + named
    return TableHeader(separator, named, text, rows, dict(zip(titles, numbers, strict=True)))


def _parse_lines(
    lines: Iterator[Line], separator: str | None, titles: Sequence[str]
) -> list[Array]:
    """The columns of lines.

    Args:
        lines: The lines.
        separator: Separator of the values; None for white space.
        titles: Names of the columns, for messages.

    Raises:
        ValueError: Lines of different lengths, or values that are not numbers.
        csv.Error: Quotes that do not match.
    """
    columns: list[list[Array]] = [[] for _ in titles]
    while chunk := list(islice(lines, _CHUNK)):
        numbers, texts = zip(*chunk, strict=True)
        rows = list(_rows(map(decode, texts), separator))
        if len(rows) < len(chunk):
            raise ValueError(f"after line {numbers[0]}, quotes run over several lines")
        for number, row in zip(numbers, rows, strict=True):
            if len(row) != len(titles):
                raise ValueError(f"line {number} has {len(row)} values for {len(titles)} columns")
        for title, column, values in zip(titles, columns, zip(*rows, strict=True), strict=True):
            try:
                column.append(_numbers(values))
            except ValueError:
                odd = next(place for place, value in enumerate(values) if not _is_number(value))
                reason = f"line {numbers[odd]}: {title} is '{values[odd]}', not a number"
                raise ValueError(reason) from None
    return [_joined(column) for column in columns]


def _numbers(texts: Sequence[str]) -> Array:
    """The numbers of some texts: int64, or uint64 if only that holds them, or else float64.

    Raises:
        ValueError: A text that is no number.
    """
    for kind in (np.int64, np.uint64):
        with suppress(ValueError, OverflowError):
            return np.fromiter(map(int, texts), kind, len(texts))
    return np.fromiter(map(_number, texts), np.float64, len(texts))


def _joined(parts: Sequence[Array]) -> Array:
    """The parts of a column as one, of a type as for `_numbers`."""
    if not parts:
        return np.empty(0)
    kinds = {part.dtype.kind for part in parts}
    if kinds == {"i", "u"} and all(part.min() >= 0 for part in parts):
        return np.concatenate(parts, dtype=np.uint64, casting="unsafe")
    return np.concatenate(parts)  # of whole numbers and others, or of both signs: float64


def _rows(lines: Iterable[str], separator: str | None) -> Iterator[list[str]]:
    if separator is None:
        return map(str.split, lines)
    return csv.reader(lines, delimiter=separator, skipinitialspace=True, strict=True)


def _number(text: str) -> float:
    """Parses a number; an empty text is NaN."""
    return float(text.strip() or "nan")


def _is_number(text: str) -> bool:
    try:
        _number(text)
    except ValueError:
        return False
    return True
