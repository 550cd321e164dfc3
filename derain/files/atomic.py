"""Writing a file whole or not at all, and the temporary files that this takes.

The next run removes the temporary files of one that was killed: each is locked, and the system
releases the lock when the process dies.
"""

import errno
import os
import secrets
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

from derain.errors import InputError

PREFIX = ".derain-"

# No format has a longer one; what follows the last point of a long name is none, and the temporary
# name must not be longer than a name may be.
LONGEST_SUFFIX = 16


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Lends a temporary file that takes the place of `path` when the block ends well.

    Until then `path` stays as it was; after an error the temporary file is gone. It is hidden, has
    the same suffix where that may be one of a format, and lies in the same folder, which is created
    if missing. What a killed process leaves there goes when the next one writes to the folder. A
    file that is replaced passes on its permissions, and a symbolic link leads to the new file.

    Nothing is synchronised to the disk: a process that is killed leaves no half-written file, but a
    machine that loses its power may.

    Args:
        path: The file to write.

    Yields:
        The temporary file, empty.

    Raises:
        InputError: `path` cannot be written: it is a folder or a device, its folder is not
            writable, the disk is full.
    """
    try:
        if path.exists() and not path.is_file():
            raise InputError(path, "is not a file that can be replaced", "Name a file to write.")
        target = Path(os.path.realpath(path))
        target.parent.mkdir(parents=True, exist_ok=True)
        with _temporary_beside(target) as temporary:
            yield temporary
            if target.exists():
                shutil.copymode(target, temporary)
            os.replace(temporary, target)
    except BrokenPipeError:  # the pipe is one that the block prints to, never the file
        raise
    except OSError as error:
        raise InputError(
            path,
            f"cannot be written ({error.strerror or error})",
            "Choose a folder that is writable and has room.",
        ) from error


def require_writable(path: Path) -> None:
    """Refuses, before long work, a file that could not be written after it.

    Its folder is made if missing; an existing file stays as it is.

    Args:
        path: The file to write later.

    Raises:
        InputError: It cannot be written.
    """
    with suppress(_OnlyTried), replacing(path):
        raise _OnlyTried


class _OnlyTried(Exception):  # noqa: N818, it signals no error
    """Ends a trial of :func:`replacing` before the file takes its place."""


@contextmanager
def _temporary_beside(path: Path) -> Iterator[Path]:
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


def lock(descriptor: int, *, wait: bool) -> bool:
    """Locks an open file or folder, until it is closed, against all others that ask in this way.

    Args:
        descriptor: The file, open for writing, or the folder.
        wait: Whether to wait for another process that holds it.

    Returns:
        False where another holds it and is not waited for.

    Raises:
        OSError: There are no locks: the system is Windows, or the file system has none.
    """
    try:
        import fcntl
    except ImportError as error:
        raise OSError(errno.ENOSYS, os.strerror(errno.ENOSYS)) from error
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
    except BlockingIOError:
        return False
    return True
