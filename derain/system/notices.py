"""Warnings about scans: each kind once in detail, then the number of further scans."""

import sys
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Protocol

from tqdm import tqdm

from derain.errors import counted, printable


class Notice(Protocol):
    """A finding about a scan, such as a :class:`derain.views.scan_issues.ScanIssue`."""

    @property
    def kind(self) -> str:
        """Its kind, in the same words for every scan."""

    @property
    def detail(self) -> str:
        """Its details in this scan."""


class Notices:
    """Warns on stderr of findings about scans.

    The scans of a folder mostly have the same fault, with other numbers. So the first scan of each
    kind is reported in detail, and at the end the number of further ones.
    """

    def __init__(self) -> None:
        self._seen: Counter[str] = Counter()

    def warn(self, scan: str, notices: Iterable[Notice], method: str = "") -> None:
        """Warns of a scan.

        Args:
            scan: Its name.
            notices: Findings about it.
            method: Title of the method that has them, where there are several.
        """
        prefix = f"{method}: " if method else ""
        for notice in notices:
            self._seen[prefix + notice.kind] += 1
            if self._seen[prefix + notice.kind] == 1:
                warn(f"{scan}: {prefix}{notice.detail}")

    def warn_of_repeats(self) -> None:
        """Prints the number of further scans of each kind."""
        for kind, scans in self._seen.items():
            if scans > 1:
                warn(f"{counted(scans - 1, 'more scan')}: {kind}")


def warn(text: str) -> None:
    """Warns on stderr, in one line.

    Args:
        text: The warning.
    """
    for change in reversed(_changes):
        text = change(text)
    # Not print: a progress bar may be in the line.
    tqdm.write(f"derain: warning: {printable(text)}", sys.stderr)


# Of the blocks of `changed_warnings` that run, the innermost last.
_changes: list[Callable[[str], str]] = []


@contextmanager
def changed_warnings(change: Callable[[str], str]) -> Iterator[None]:
    """Changes the text of each warning of :func:`warn` in the block, such as what names a file."""
    _changes.append(change)
    try:
        yield
    finally:
        _changes.pop()


@contextmanager
def recorded_warnings() -> Iterator[list[str]]:
    """Lends a list of the warnings of :func:`warn`, which grows while the block runs."""
    record: list[str] = []

    def recorded(text: str) -> str:
        record.append(text)
        return text

    with changed_warnings(recorded):
        yield record


@cache
def warn_once(text: str) -> None:
    """Warns as :func:`warn` does, once for each text in this process."""
    warn(text)
