"""Points as text (`.csv`): a line of names, then a line a point; REHEARSE-3D's extended radar.

Source: Y. Shafranovich, "Common Format and MIME Type for Comma-Separated Values (CSV) Files",
RFC 4180.
"""

import csv
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

import numpy as np
from numpy.typing import NDArray

from derain.errors import InputError
from derain.files.atomic import replacing
from derain.files.columns import columns_of, scan_of
from derain.files.reading import reading
from derain.scan import Scan

# Names in any encoding come back as they were.
_TEXT: dict[str, Any] = {"newline": "", "errors": "surrogateescape"}


@dataclass(frozen=True)
class CsvHeader:
    """What stands between the values of a line: a comma or a semicolon."""

    separator: str = ","


def read_csv(path: Path) -> Scan:
    """Reads a table of points.

    Args:
        path: The file: names of the columns, then one line a point, empty lines aside. Values are
            separated by commas, or by semicolons if there is no comma among the names, and may be
            in quotes; an empty one is NaN.

    Returns:
        The scan. Columns of whole numbers, written without a point, are int64 (uint64 if only that
        holds them), all others float64; a file of names alone is a scan of zero points.

    Raises:
        InputError: A file that cannot be read, has lines of different lengths or values that are
            not numbers, names two columns alike, or has no coordinates.
    """
    with reading(path, ValueError, csv.Error), path.open(encoding="utf-8-sig", **_TEXT) as file:
        header, fields = _parse(file)
    return scan_of(path, fields, header=header)


def write_csv(path: Path, scan: Scan) -> None:
    """Writes a scan's columns, with as many digits as give every value back.

    They come back in the types that `read_csv` states, separated as in the CSV that the scan came
    from, else by commas.

    Raises:
        InputError: A column that no CSV can hold, or a file that cannot be written.
    """
    columns = columns_of(scan)
    for name, column in columns.items():
        _refuse_unreadable(path, name, column)
    header = scan.header if isinstance(scan.header, CsvHeader) else CsvHeader()
    values = [
        (column.astype(np.uint8) if column.dtype == bool else column).tolist()
        for column in columns.values()
    ]
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8", **_TEXT) as file:
        writer = csv.writer(file, delimiter=header.separator, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(zip(*values, strict=True))


def _parse(file: TextIO) -> tuple[CsvHeader, dict[str, NDArray[Any]]]:
    first = next((line for line in file if line.strip()), "")
    file.seek(0)
    header = CsvHeader("," if "," in first else ";")
    table = _lines(file, header.separator)
    number, line = next(table, (1, []))
    names = [name.strip() for name in line]
    if not names:
        raise ValueError("no names of columns")
    if len(set(names)) < len(names):
        raise ValueError(f"line {number} names two columns alike: {', '.join(names)}")
    numbers, rows = [], []
    for number, line in table:
        if len(line) != len(names):
            raise ValueError(f"line {number} has {len(line)} values for {len(names)} columns")
        numbers.append(number)
        rows.append(line)
    columns = zip(*rows, strict=True) if rows else [()] * len(names)
    return header, {
        name: _values(name, texts, numbers) for name, texts in zip(names, columns, strict=True)
    }


def _lines(file: TextIO, separator: str) -> Iterator[tuple[int, list[str]]]:
    """The lines that are not empty, each with its number."""
    lines = csv.reader(file, delimiter=separator, skipinitialspace=True, strict=True)
    return ((lines.line_num, line) for line in lines if len(line) > 1 or any(line))


def _values(name: str, texts: Sequence[str], numbers: Sequence[int]) -> NDArray[Any]:
    """A column of numbers, whole if all of them are; `numbers` are those of its lines."""
    if texts:
        for whole in (np.int64, np.uint64):
            with suppress(ValueError, OverflowError):
                return np.array(texts, whole)
    values = np.empty(len(texts))
    for row, text in enumerate(texts):
        try:
            values[row] = float(text.strip() or "nan")
        except ValueError:
            raise ValueError(f"line {numbers[row]}: {name} is '{text}', not a number") from None
    return values


def _refuse_unreadable(path: Path, name: str, column: NDArray[Any]) -> None:
    """Refuses a column that would not come back."""
    one_line = name == name.strip() and len(name.splitlines()) < 2
    number = column.dtype.kind in "biuf" and column.dtype.itemsize <= 8
    if not one_line or not number or column.ndim > 1:
        raise InputError(
            path,
            f".csv has no place for the column '{name}' ({column.dtype}, {column.ndim} axes)",
            "Write .npz.",
        )
