"""What formats with a text header share: names in any encoding, and points as lines of numbers."""

import io
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

# Enough digits for every float32 and every float64 to come back as it was.
_DECIMALS = {"f4": "%.9g", "f8": "%.17g"}


def decode(line: bytes) -> str:
    """Text of a header; `encode` gives back the same bytes, whatever their encoding is."""
    return line.decode("utf-8", "surrogateescape")


def encode(text: str) -> bytes:
    """Bytes of a header, the inverse of `decode`."""
    return text.encode("utf-8", "surrogateescape")


def parse_rows(data: bytes, row: np.dtype[Any], lines: slice = slice(None)) -> NDArray[Any]:
    """Reads one structured value per line of numbers; empty lines are passed over.

    Args:
        data: The text.
        row: Dtype of a line; its fields may be sub-arrays.
        lines: Which of the lines to read.

    Raises:
        ValueError: A line that is not of this dtype.
    """
    text = data.splitlines()[lines]
    if not any(map(bytes.strip, text)):
        return np.empty(0, row)
    return np.loadtxt(text, row, comments=None, ndmin=1, encoding="latin-1")


def format_rows(table: NDArray[Any]) -> bytes:
    """Writes every value of a packed structured array (N,) as a line of numbers."""
    dtypes = [table.dtype[name] for name in table.dtype.names or ()]
    values = [dtype.base for dtype in dtypes for _ in range(math.prod(dtype.shape))]
    flat = table.view([(str(place), value) for place, value in enumerate(values)])
    text = io.BytesIO()
    np.savetxt(text, flat, [_DECIMALS.get(value.str[1:], "%d") for value in values])
    return text.getvalue()
