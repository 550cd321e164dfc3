"""What commands print, and where they may write what they make of scans."""

import sys
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TextIO

from tqdm import tqdm

from derain.errors import InputError, printable
from derain.files.atomic import replacing
from derain.files.labels import label_beside
from derain.files.names import scan_stem


def refuse_clashes(scans: Sequence[Path], out: Path) -> None:
    """Refuses to overwrite a scan by what is made of it, or labels by others.

    Args:
        scans: What is read.
        out: Folder where a file of each scan's name, and labels of that name, are to be written.

    Raises:
        InputError: It holds a scan or its labels, or two scans have one name.
    """
    stems = Counter(map(scan_stem, scans))
    for scan in scans:
        if (out / scan.name).resolve() == scan.resolve():
            raise InputError(out, f"would overwrite {scan}", "Give --out another folder.")
        if out.resolve() == label_beside(scan).parent.resolve():
            raise InputError(out, f"holds the labels of {scan}", "Give --out another folder.")
        if stems[scan_stem(scan)] > 1:
            raise InputError(
                scan, "another scan has the same name", "Take them in two runs, each to its --out."
            )


def say(text: str, stream: TextIO | None = None) -> None:
    """Prints lines, above a progress bar if there is one, with escapes for what no terminal shows.

    Args:
        text: The lines; names in them may hold anything.
        stream: Where to; None is the standard output.
    """
    tqdm.write("\n".join(map(printable, text.split("\n"))), stream or sys.stdout)


def refuse_unwritable(path: Path) -> None:
    """Refuses, before long work, a file that could not be written after it.

    Its folder is made if missing; what is there stays as it is.

    Args:
        path: The file that is to be written.

    Raises:
        InputError: It cannot be written.
    """
    with suppress(_NotYet), replacing(path):
        raise _NotYet


class _NotYet(Exception):  # noqa: N818, for nothing went wrong
    """Ends a writing that was only tried."""
