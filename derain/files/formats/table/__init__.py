"""Points as lines of text (`.csv`, `.txt`, `.xyz`, `.asc`); REHEARSE-3D's extended radar.

Source: Y. Shafranovich, "Common Format and MIME Type for Comma-Separated Values (CSV) Files",
RFC 4180.
"""

import csv
import io
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from derain.errors import InputError
from derain.files.columns import columns_of, name_columns, scan_of
from derain.files.content import Content
from derain.files.format import FORMATS, Format
from derain.files.formats.table.text import TableHeader, parse_table
from derain.files.names import scan_suffix
from derain.files.reading import reading
from derain.files.text import encode
from derain.scan import Scan


@FORMATS.add(".asc", ".xyz")
class Table(Format):
    """Lines of numbers, perhaps under a line of names."""

    HELP = "lines of numbers, perhaps under a line of names"
    UNNAMED = "text without a line of names"

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
        path = content.path
        with reading(path, ValueError, csv.Error):
            header, numbers = parse_table(content.data)
        if header.named:
            fields = dict(zip(header.columns, numbers, strict=True))
        else:
            numbers = numbers or [np.empty(0)] * len(columns)
            fields = name_columns(path, numbers, columns)
        return scan_of(path, fields, header=replace(header, columns=tuple(fields)))

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
        if header is not None and header.says(columns):
            return header.lines()
        separator = header.separator if header else "," if scan_suffix(path) == ".csv" else None
        named = header is None or header.named or header.columns != tuple(columns)
        for name, column in columns.items():
            _refuse_unreadable(path, name, column, separator)
        values = [
            (column.astype(np.uint8) if column.dtype == bool else column).tolist()
            for column in columns.values()
        ]
        text = io.StringIO()
        writer = csv.writer(text, delimiter=separator or " ", lineterminator="\n")
        if named:
            writer.writerow(columns)
        writer.writerows(zip(*values, strict=True))
        return encode(text.getvalue())


@FORMATS.add(".csv")
class CommaSeparated(Table):
    """A table that beside scans of other formats is likely to be a record of something else."""

    RECORD = 1


@FORMATS.add(".txt")
class Text(Table):
    """A table that is even likelier to be something else, such as notes or a list of poses."""

    RECORD = 2


def _refuse_unreadable(path: Path, name: str, column: NDArray[Any], separator: str | None) -> None:
    """Refuses a column that could not be read again as it was."""
    one_line = name == name.strip() and len(name.splitlines()) < 2
    one_word = separator is not None or not set(name) & set(",; \t\"'")
    no_comment = not name.startswith(("#", "//"))
    number = column.dtype.kind in "biuf" and column.dtype.itemsize <= 8
    if not (one_line and one_word and no_comment and number) or column.ndim > 1:
        raise InputError(
            path,
            f"{scan_suffix(path)} has no place for the column '{name}' "
            f"({column.dtype}, {column.ndim} axes)",
            "Write .npz.",
        )
