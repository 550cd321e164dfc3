"""Temporary files, which the next run removes where this one is killed."""

import os
import secrets
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

from derain.files.lock import lock

PREFIX = ".derain-"

# No format has a longer one; what follows the last point of a long name is none, and the temporary
# name must not be longer than a name may be.
LONGEST_SUFFIX = 16


@contextmanager
def temporary_beside(path: Path) -> Iterator[Path]:
    """Lends an empty hidden file in the folder of another, with its suffix if a format may have it.

    It is gone when the block ends. A process that is killed leaves it; it holds a lock that goes
    with the process, so that others can tell.

    Args:
        path: The other file, which need not exist.

    Raises:
        OSError: The folder cannot be written.
    """
    remove_abandoned(path.parent)
    suffix = path.suffix if len(os.fsencode(path.suffix)) <= LONGEST_SUFFIX else ""
    temporary = path.with_name(f"{PREFIX}{secrets.token_hex(8)}{suffix}")
    try:
        with _holding(temporary, _made_file):
            yield temporary
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def temporary_folder(folder: Path) -> Iterator[Path]:
    """Lends an empty hidden folder in another, which is made if missing.

    It is gone when the block ends in this process, with what is in it then; a fork of the process
    leaves it. A process that is killed leaves it; it is locked, so that others can tell.

    Args:
        folder: The other folder.

    Raises:
        OSError: The folder cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    remove_abandoned(folder)
    temporary = folder / f"{PREFIX}{secrets.token_hex(8)}"
    process = os.getpid()
    try:
        with _holding(temporary, _made_folder):
            yield temporary
    finally:
        if os.getpid() == process:
            shutil.rmtree(temporary, ignore_errors=True)


@contextmanager
def _holding(path: Path, make: Callable[[Path], int]) -> Iterator[None]:
    """Makes a file or a folder, and keeps it locked inside the ``with`` block."""
    while not _locked(descriptor := make(path)):
        os.close(descriptor)
    try:
        yield
    finally:
        os.close(descriptor)


def _made_file(file: Path) -> int:
    return os.open(file, os.O_CREAT | os.O_EXCL | os.O_RDWR, 0o666)


def _made_folder(folder: Path) -> int:
    while True:
        folder.mkdir()
        with suppress(FileNotFoundError):  # another process removed it as abandoned
            return os.open(folder, os.O_RDONLY)


def _locked(descriptor: int) -> bool:
    """Locks a new file or folder; False where another process removed it before as abandoned."""
    try:
        lock(descriptor, wait=True)
    except OSError:  # a file system without locks, where no process removes anything
        return True
    return os.fstat(descriptor).st_nlink > 0


@cache
def remove_abandoned(folder: Path) -> None:
    """Removes what killed processes have left in a folder, once in the life of this process.

    Args:
        folder: The folder, which need not exist.
    """
    for file in folder.glob(f"{PREFIX}*"):
        with suppress(OSError):  # somebody else's, or gone, or on a file system without locks
            is_folder = file.is_dir()
            descriptor = os.open(file, os.O_RDONLY if is_folder else os.O_RDWR)
            try:
                if lock(descriptor, wait=False):
                    shutil.rmtree(file) if is_folder else file.unlink()
            finally:
                os.close(descriptor)
