"""Parses lines of numbers, perhaps under a line of names."""

import csv
import io
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, islice
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from derain.files.content import check_columns
from derain.files.text import decode

_BYTE_ORDER_MARK = b"\xef\xbb\xbf"

# What some programs put before the line of names.
_COMMENT = re.compile(r"\s*(#|//)")

# Lines that are held as text at a time, which takes ten times the memory of their numbers.
_CHUNK = 4096


class Line(NamedTuple):
    """A line of a text: its number, where it begins and ends, and what it says."""

    number: int
    begin: int
    end: int
    text: str


@dataclass(frozen=True, eq=False)
class TableHeader:
    """A table as it was written.

    Attributes:
        separator: What stands between the values of a line; None for white space.
        columns: Names of the columns.
        named: Whether a line of the file names them.
        text: The whole file.
        begin: Where its lines of points begin.
        spans: Where each point's line begins and ends in the text, in bytes, int64 (N, 2).
    """

    separator: str | None
    columns: tuple[str, ...]
    named: bool
    text: bytes
    begin: int
    spans: NDArray[np.int64]

    def take(self, rows: NDArray[Any]) -> "TableHeader":
        """The table of some of the points only."""
        return replace(self, spans=self.spans[rows])

    def says(self, columns: Mapping[str, NDArray[Any]]) -> bool:
        """Whether the lines hold just these columns, with these numbers."""
        if tuple(columns) != self.columns:
            return False
        lines = (
            Line(0, begin, end, decode(self.text[begin:end])) for begin, end in self.spans.tolist()
        )
        written, _ = parse_lines(lines, self.separator, self.columns)
        return all(
            np.array_equal(ours, theirs, equal_nan=True)
            for ours, theirs in zip(written, columns.values(), strict=True)
        )

    def lines(self) -> bytes:
        """The line of names, if there is one, and the lines of the points, as they were written."""
        newline = b"\r\n" if b"\r\n" in self.text else b"\n"
        names = [self.text[: self.begin]] if self.named else []
        points = (self.text[begin:end] for begin, end in self.spans.tolist())
        return b"".join(line + newline for line in (*names, *points))


def parse_table(text: bytes) -> tuple[TableHeader, list[NDArray[Any]]]:
    """Reads lines of numbers; empty lines are passed over.

    Values are separated by commas if there is one in the first line, else by semicolons, else by
    white space. The first line names the columns if any of its values is no number.

    Returns:
        The table as it was written, without names of columns where no line names them, and the
        numbers, a column (N,) each.

    Raises:
        ValueError: Lines of different lengths, values that are not numbers, or two columns of one
            name.
        csv.Error: Quotes that do not match.
    """
    lines = filled_lines(text)
    first = next(lines, None)
    if first is None:
        return TableHeader(",", (), False, text, 0, np.empty((0, 2), np.int64)), []
    separator = next((each for each in ",;" if each in first.text), None)
    (values,) = _rows([_COMMENT.sub("", first.text)], separator)
    check_columns(len(values))
    names = () if all(map(_is_number, values)) else tuple(name.strip() for name in values)
    if not names:
        lines = chain([first], lines)
    elif len(set(names)) < len(names):
        raise ValueError(f"line {first.number} names two columns alike: {', '.join(names)}")
    titles = names or [f"column {number}" for number, _ in enumerate(values, 1)]
    columns, spans = parse_lines(lines, separator, titles)
    begin = first.end if names else 0
    return TableHeader(separator, names, bool(names), text, begin, spans), columns


def filled_lines(text: bytes) -> Iterator[Line]:
    """The lines of a text that are not empty."""
    end = len(_BYTE_ORDER_MARK) if text.startswith(_BYTE_ORDER_MARK) else 0
    file = io.BytesIO(text)
    file.seek(end)
    for number, line in enumerate(file, 1):
        begin, end = end, end + len(line)
        if line.strip():
            line = line.rstrip(b"\r\n")
            yield Line(number, begin, begin + len(line), decode(line))


def parse_lines(
    lines: Iterable[Line], separator: str | None, titles: Sequence[str]
) -> tuple[list[NDArray[Any]], NDArray[np.int64]]:
    """The numbers of lines.

    Args:
        lines: The lines.
        separator: What stands between the values; None for white space.
        titles: What the columns are called, for messages.

    Returns:
        The columns, and where each line begins and ends, as in TableHeader.

    Raises:
        ValueError: Lines of different lengths, or values that are not numbers.
        csv.Error: Quotes that do not match.
    """
    columns = [_Numbers() for _ in titles]
    spans = [np.empty((0, 2), np.int64)]
    lines = iter(lines)
    while chunk := list(islice(lines, _CHUNK)):
        rows = list(_rows((line.text for line in chunk), separator))
        if len(rows) < len(chunk):
            raise ValueError(f"after line {chunk[0].number}, quotes run over several lines")
        for line, row in zip(chunk, rows, strict=True):
            if len(row) != len(titles):
                raise ValueError(
                    f"line {line.number} has {len(row)} values for {len(titles)} columns"
                )
        for title, column, texts in zip(titles, columns, zip(*rows, strict=True), strict=True):
            if (odd := column.add(texts)) is not None:
                raise ValueError(
                    f"line {chunk[odd].number}: {title} is '{texts[odd]}', not a number"
                )
        spans.append(np.array([(line.begin, line.end) for line in chunk]))
    return [column.values() for column in columns], np.concatenate(spans)


class _Numbers:
    """The numbers of one column: whole ones, as long as all are, and floating-point ones."""

    def __init__(self) -> None:
        self._whole: dict[type[Any], list[NDArray[Any]]] = {np.int64: [], np.uint64: []}
        self._floating = [np.empty(0)]

    def add(self, texts: Sequence[str]) -> int | None:
        """Appends numbers; returns the place of the first text that is none."""
        for kind in list(self._whole):
            try:
                self._whole[kind].append(np.fromiter(map(int, texts), kind, len(texts)))
            except (ValueError, OverflowError):
                del self._whole[kind]
        try:
            self._floating.append(np.fromiter(map(_number, texts), np.float64, len(texts)))
        except ValueError:
            return next(place for place, text in enumerate(texts) if not _is_number(text))
        return None

    def values(self) -> NDArray[Any]:
        """All of them: int64, or uint64 if only that holds them, or else float64."""
        return np.concatenate(
            next((whole for whole in self._whole.values() if whole), self._floating)
        )


def _rows(lines: Iterable[str], separator: str | None) -> Iterator[list[str]]:
    if separator is None:
        return map(str.split, lines)
    return csv.reader(lines, delimiter=separator, skipinitialspace=True, strict=True)


def _number(text: str) -> float:
    """The number that a text stands for; an empty one is NaN."""
    return float(text.strip() or "nan")


def _is_number(text: str) -> bool:
    try:
        _number(text)
    except ValueError:
        return False
    return True
