"""Shared parts of formats with a text header: names in any encoding, points as lines of numbers."""

import io
import math
from collections.abc import Iterator
from itertools import chain, islice
from typing import Any

import numpy as np

from derain.scan import Array

# Bytes of a header, which has a line or a word for each column.
LARGEST_HEADER = 2**20

# Number of a line, from 1, and its content without the end of line.
Line = tuple[int, bytes]

BYTE_ORDER_MARK = b"\xef\xbb\xbf"

# Enough digits for every float32 and every float64 to come back as it was.
_DECIMALS = {"f4": "%.9g", "f8": "%.17g"}


def decode(line: bytes) -> str:
    """Text of a header, in any encoding; `encode` returns the same bytes."""
    return line.decode("utf-8", "surrogateescape")


def encode(text: str) -> bytes:
    """Bytes of a header, the inverse of `decode`."""
    return text.encode("utf-8", "surrogateescape")


def filled_lines(text: bytes) -> Iterator[Line]:
    """The lines of a text that are not empty."""
    for number, line in enumerate(io.BytesIO(text), 1):
        if line.strip() not in (b"", BYTE_ORDER_MARK):
            yield number, line.rstrip(b"\r\n")


def parse_rows(data: bytes, row: np.dtype[Any], count: int | None = None) -> Array:
    """Reads one structured value per line of numbers; empty lines are skipped.

    Args:
        data: The text.
        row: Dtype of a line; its fields may be sub-arrays.
        count: Number of lines to read, if there are as many; None reads all.

    Raises:
        ValueError: A line that is not of this dtype, or more lines than can be counted.
    """
    lines = (line for _, line in islice(filled_lines(data), count))
    first = next(lines, None)
    if first is None:
        return np.empty(0, row)
    values, stated = len(first.split()), sum(math.prod(row[name].shape) for name in row.names or ())
    # Before anything is allocated: a header of a few bytes may state any number of values.
    if values != stated:
        raise ValueError(f"a line of {values} values where the header states {stated}")
    return np.loadtxt(chain([first], lines), row, comments=None, ndmin=1, encoding="latin-1")


def format_rows(table: Array) -> bytes:
    """Writes every value of a packed structured array (N,) as a line of numbers."""
    dtypes = [table.dtype[name] for name in table.dtype.names or ()]
    values = [dtype.base for dtype in dtypes for _ in range(math.prod(dtype.shape))]
    flat = table.view([(str(place), value) for place, value in enumerate(values)])
    text = io.BytesIO()
    np.savetxt(text, flat, [_DECIMALS.get(value.str[1:], "%d") for value in values])
    return text.getvalue()
