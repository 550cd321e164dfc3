"""Records that are lines of numbers."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from derain.errors import InputError
from derain.files.reading import read_bytes, reading
from derain.scan import Floats

# A pose takes 160 bytes: those of four hundred thousand scans.
LARGEST_RECORD = 2**26


def read_numbers(path: Path, *columns: int) -> Floats:
    """Reads lines of finite numbers; empty lines and comments (#) are skipped.

    Args:
        path: The file.
        columns: Permitted numbers of values in a line; the first line selects one.

    Returns:
        float64 (T, columns); of a file without lines, as many as are named last.

    Raises:
        InputError: A file that cannot be read, is too large, or has another line.
    """
    rows: list[list[float]] = []
    width = 0
    for place, line in enumerate(read_lines(path), 1):
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        width = width or (len(words) if len(words) in columns else columns[-1])
        rows.append(finite_numbers(path, place, words, width))
    return np.array(rows, np.float64).reshape(-1, width or columns[-1])


def read_lines(path: Path) -> list[str]:
    """The lines of a record.

    Raises:
        InputError: A file that cannot be read, or is too large.
    """
    with reading(path, ValueError):
        return read_bytes(path, LARGEST_RECORD).decode("utf-8-sig").splitlines()


def finite_numbers(path: Path, place: int, words: Sequence[str], count: int) -> list[float]:
    """The numbers of one line.

    Args:
        path: The file.
        place: Number of the line, for messages.
        words: The text of the line, split.
        count: Number of values that it must have.

    Raises:
        InputError: Something else.
    """
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = []
    if len(numbers) != count or not np.isfinite(numbers).all():
        raise InputError(
            path,
            f"line {place} is not {count} number{'s' if count > 1 else ''}",
            "Write the file again, a line for each scan.",
        )
    return numbers
