"""Telling of what is odd about scans: each kind once, and how many more have it."""

import sys
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Protocol

from tqdm import tqdm

from derain.errors import printable


class Notice(Protocol):
    """Something that a user is told of a scan, such as a :class:`derain.views.oddities.Oddity`."""

    @property
    def kind(self) -> str:
        """What it is, in the same words for every scan that has it."""

    @property
    def detail(self) -> str:
        """How it shows in this scan."""


class Notices:
    """Warns on stderr of what is odd, each kind with the first scan that has it.

    The scans of a folder mostly have the same fault, with other numbers. So of each kind the first
    scan is told in detail; of those after it, only their number is told, at the end.
    """

    def __init__(self) -> None:
        self._seen: Counter[str] = Counter()

    def tell(self, scan: str, notices: Iterable[Notice], method: str = "") -> None:
        """Warns of a scan.

        Args:
            scan: Its name.
            notices: What is odd about it.
            method: Title of the method that finds it so, where there are several.
        """
        prefix = f"{method}: " if method else ""
        for notice in notices:
            self._seen[prefix + notice.kind] += 1
            if self._seen[prefix + notice.kind] == 1:
                warn(f"{scan}: {prefix}{notice.detail}")

    def tell_how_many_more(self) -> None:
        """Says of each kind how many more scans had it."""
        for kind, scans in self._seen.items():
            if scans > 1:
                more = "1 more scan" if scans == 2 else f"{scans - 1:,} more scans"
                warn(f"{more}: {kind}")


def warn(text: str) -> None:
    """Warns on stderr, in one line.

    Args:
        text: What of.
    """
    for record in _records:
        record.append(text)
    # Not print: a progress bar may stand in the line.
    tqdm.write(f"derain: warning: {printable(text)}", sys.stderr)


# Of the blocks of `recorded_warnings` that run, the innermost last.
_records: list[list[str]] = []


@contextmanager
def recorded_warnings() -> Iterator[list[str]]:
    """Lends a list of the warnings of :func:`warn`, which grows while the block runs."""
    record: list[str] = []
    _records.append(record)
    try:
        yield record
    finally:
        _records.pop()


@cache
def warn_once(text: str) -> None:
    """Warns as :func:`warn` does, of each text once in the life of this process."""
    warn(text)
