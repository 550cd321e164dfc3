"""Whether there is room for a recording to look at, before it is written."""

import shutil
from pathlib import Path

from derain.errors import InputError

# The viewer keeps a recording in memory; from here on it is worth a word.
LARGE = 4e9


def refuse_too_large(path: Path, size: int) -> None:
    """Refuses, before any work, what the disk has no room for.

    Args:
        path: The file.
        size: How large it becomes, bytes.

    Raises:
        InputError: Less is free.
    """
    free = shutil.disk_usage(next(folder for folder in path.absolute().parents if folder.is_dir()))
    if size > free.free:
        raise InputError(
            path,
            f"it would take about {megabytes(size)}, and {megabytes(free.free)} are free",
            "Show fewer scans: --frames 0:100, or --every 10.",
        )


def megabytes(size: int) -> str:
    """A size in words."""
    return f"{size / 1e6:,.1f} MB" if size < 1e8 else f"{size / 1e6:,.0f} MB"
