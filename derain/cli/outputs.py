"""Output of commands: lines, errors, exit codes, and the folders that they may write to."""

import json
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO

from tqdm import tqdm

from derain.errors import InputError, printable
from derain.files.atomic import require_writable_folder
from derain.sources.sink import FolderSink
from derain.sources.source import Source


def folder_sink(out: Path, source: Source) -> FolderSink:
    """The folder that a command writes to, once it is known to overwrite nothing of the source.

    Args:
        out: Place of ``--out``.
        source: The source.

    Raises:
        InputError: It holds a scan or labels that would be overwritten, two scans have one name, or
            it cannot be written.
    """
    sink = FolderSink(out)
    sink.refuse_clashes(source)
    require_writable_folder(out)
    return sink


def print_facts(facts: Mapping[str, Any], text: str, as_json: bool) -> None:
    """Prints what was done to a scan, above a progress bar.

    Args:
        facts: As an object.
        text: As a line of text; a name in it may hold anything.
        as_json: True for JSON.
    """
    print_line(json.dumps(facts) if as_json else text)


def print_line(text: str) -> None:
    """Prints what was done to a scan, above a progress bar; a name in it may hold anything."""
    tqdm.write(printable(text), sys.stdout)
    sys.stdout.flush()  # so that the reader of a pipe gets each line at once


def print_lines(text: str, stream: TextIO | None = None) -> None:
    """Prints lines, above a progress bar if there is one, with escapes for what no terminal shows.

    Args:
        text: The lines; names in them may hold anything.
        stream: Stream to print to; None is the standard output.
    """
    tqdm.write("\n".join(map(printable, text.split("\n"))), stream or sys.stdout)


def print_error(error: InputError) -> None:
    """Prints an error on stderr, above a progress bar."""
    tqdm.write(f"derain: {error}", sys.stderr)


@contextmanager
def noting_progress(so_far: Callable[[], str]) -> Iterator[None]:
    """Adds to the error of a closed pipe, as by ``| head``, what the command has written by then.

    Args:
        so_far: The written results, for instance "2 of 41 scans are written".
    """
    try:
        yield
    except BrokenPipeError as error:
        error.add_note(f"the output was closed before the end: {so_far()}")
        raise


def exit_code(failed: int, scans: int, outcome: str) -> int:
    """The command's exit code: 2 where scans failed, which it prints, else 0.

    Args:
        failed: Number of scans that failed.
        scans: Number of all scans.
        outcome: Outcome of those that failed, with their number as ``{scans}``.
    """
    if not failed:
        return 0
    print(f"derain: {outcome.format(scans=f'{failed} of {scans} scans')}", file=sys.stderr)
    return 2
