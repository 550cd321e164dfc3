"""What commands print, and the files and folders that they may write."""

import json
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from tqdm import tqdm

from derain.errors import InputError, printable
from derain.sources.frame import Frame
from derain.sources.judging import Failures
from derain.sources.sink import FolderSink
from derain.sources.source import Source

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


def folder_sink(out: Path, source: Source, removed: Path | None = None) -> FolderSink:
    """The folder that a command writes to, once it is known to overwrite nothing of the source.

    Args:
        out: What ``--out`` names.
        source: What is read.
        removed: Folder for what is taken away of the scans; None where nobody asks for it.

    Raises:
        InputError: It holds a scan or labels that would be overwritten, or two scans have one name.
    """
    sink = FolderSink(out, again=False, removed=removed)
    sink.refuse_clashes(source)
    return sink


def print_facts(facts: "DataclassInstance", as_json: bool) -> None:
    """Prints what was done to a scan, above a progress bar: a line of text, or an object."""
    tqdm.write(json.dumps(asdict(facts)) if as_json else str(facts), sys.stdout)
    sys.stdout.flush()  # so that the reader of a pipe gets each line at once


def print_lines(text: str, stream: TextIO | None = None) -> None:
    """Prints lines, above a progress bar if there is one, with escapes for what no terminal shows.

    Args:
        text: The lines; names in them may hold anything.
        stream: Where to; None is the standard output.
    """
    tqdm.write("\n".join(map(printable, text.split("\n"))), stream or sys.stdout)


@contextmanager
def noting_progress(so_far: Callable[[], str]) -> Iterator[None]:
    """Adds to the error of a closed pipe, as by ``| head``, what the command has written by then.

    Args:
        so_far: What is written, for instance "2 of 41 scans are written".
    """
    try:
        yield
    except BrokenPipeError as error:
        error.add_note(f"the output was closed before the end: {so_far()}")
        raise


def require_free_path(option: str, path: Path, written: Iterable[Path]) -> None:
    """Refuses a file that would be in the way of what else a command writes.

    Args:
        option: The option that names it.
        path: The file.
        written: What else is written.

    Raises:
        InputError: It is one of these, or a folder of one, or lies in one.
    """
    place = os.path.realpath(path)
    for other in written:
        result = os.path.realpath(other)
        if place == result or result.startswith(f"{place}{os.sep}"):
            reason = f"{other} is written there"
        elif place.startswith(f"{result}{os.sep}"):
            reason = f"{other} is written in place of what is there"
        else:
            continue
        raise InputError(path, reason, f"Give {option} another file.")


class ScanByScan(Failures):
    """The frames of a source, one after the other, with a progress bar.

    It prints what is wrong with single scans, and goes on with the others.

    Args:
        source: The source.
    """

    def __init__(self, source: Source) -> None:
        super().__init__(print_error)
        self._source = source

    def __iter__(self) -> Iterator[Frame]:
        return iter(tqdm(self._source, unit="scan", disable=None))


def exit_code(failed: int, scans: int, outcome: str) -> int:
    """The command's exit code: 2 where scans failed, which it prints, else 0.

    Args:
        failed: Number of scans that failed.
        scans: Number of all scans.
        outcome: What became of those that failed, with their number as ``{scans}``.
    """
    if not failed:
        return 0
    print(f"derain: {outcome.format(scans=f'{failed} of {scans} scans')}", file=sys.stderr)
    return 2


def print_error(error: InputError) -> None:
    """Prints an error on stderr, above a progress bar."""
    tqdm.write(f"derain: {error}", sys.stderr)
