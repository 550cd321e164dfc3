"""The content of a scan file, and the one bound on its expanded size.

A small file can claim or hold far more than any scan: counts in a header, zeros that compress a
thousandfold. Whatever a reader makes room for, it takes from the file's `MemoryBudget` first.
"""

import gzip
import io
import zlib
from dataclasses import dataclass
from pathlib import Path

from derain.files.names import is_compressed
from derain.files.reading import read_bytes, reading

# Bytes that a scan may take, in its file or decoded: 30 million points of 32 bytes.
LARGEST_SCAN = 2**30

# Bytes that every file may expand to: 400,000 points of twenty columns. A frame that is nearly
# empty, or constant in most of its columns, compresses to next to nothing.
SMALLEST_BUDGET = 2**26

# Any further expansion is bounded by the file's own size. Real scans compress to a half or a tenth.
LARGEST_EXPANSION = 32

# Columns of a scan. The widest known, of an Ouster frame with two returns, has some twenty.
MOST_COLUMNS = 1024


class MemoryBudget:
    """Bytes that a file may still expand to.

    Args:
        size: Bytes of the file.
    """

    def __init__(self, size: int) -> None:
        self.left = min(LARGEST_SCAN, max(SMALLEST_BUDGET, LARGEST_EXPANSION * size))

    def reserve(self, size: int) -> None:
        """Sets bytes aside, before they are allocated.

        Raises:
            ValueError: There is no room for them.
        """
        if size > self.left:
            raise ValueError(f"it would expand by {size:,} bytes, with room for {self.left:,}")
        self.left -= size


@dataclass(frozen=True)
class Content:
    """The content of a scan file.

    Attributes:
        path: The file.
        data: Its bytes, decompressed where the file is compressed as a whole.
        budget: Bound on their expanded size.
    """

    path: Path
    data: bytes
    budget: MemoryBudget


def read_content(path: Path) -> Content:
    """Reads a file, and decompresses it if its name ends in .gz.

    Raises:
        InputError: No regular file, or one that cannot be read, is larger than any scan, or is
            damaged.
    """
    with reading(path, gzip.BadGzipFile, EOFError, zlib.error, ValueError):
        data = read_bytes(path, LARGEST_SCAN)
        budget = MemoryBudget(len(data))
        if is_compressed(path):
            with gzip.GzipFile(fileobj=io.BytesIO(data)) as file:
                data = file.read(budget.left + 1)
            budget.reserve(len(data))
        return Content(path, data, budget)


def compressed(data: bytes) -> bytes:
    """The same bytes as a .gz file, which is the same whenever it is written."""
    return gzip.compress(data, mtime=0)


def check_columns(count: int) -> None:
    """Refuses more columns than a scan has.

    Raises:
        ValueError: There are.
    """
    if count > MOST_COLUMNS:
        raise ValueError(f"{count:,} columns, more than {MOST_COLUMNS:,}")
