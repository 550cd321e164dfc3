"""Writing a file whole or not at all, and the temporary folders that this takes.

The next run removes the temporary folder of one that was killed: each is locked, and the system
releases the lock when the process dies.
"""

import errno
import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

from derain.errors import InputError

PREFIX = ".derain-"


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Lends the path of a temporary file that takes the place of `path` when the block ends well.

    Until then `path` stays as it was; after an error the temporary file is gone. It has the same
    name, in a hidden folder beside `path`, whose own folder is created if missing. What a killed
    process leaves there goes when the next one writes to the folder. A file that is replaced passes
    on its permissions, and a symbolic link leads to the new file.

    Nothing is synchronised to the disk: a process that is killed leaves no half-written file, but a
    machine that loses its power may.

    Args:
        path: The file to write.

    Yields:
        Where the block writes the file.

    Raises:
        InputError: `path` cannot be written: it is a folder or a device, its folder is not
            writable, the disk is full.
    """
    with writing(path):
        target = _target(path)
        with temporary_folder(target.parent) as folder:
            temporary = folder / target.name
            yield temporary
            if target.exists():
                shutil.copymode(target, temporary)
            os.replace(temporary, target)


def write_text(path: Path, text: str, newline: str | None = None) -> None:
    """Writes a text in UTF-8, whole or not at all; see :func:`replacing`.

    Args:
        path: The file to write.
        text: Its content.
        newline: What an end of line becomes; None for that of the system.

    Raises:
        InputError: As for :func:`replacing`.
    """
    with replacing(path) as temporary:
        temporary.write_text(text, "utf-8", newline=newline)


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Turns the errors of writing `path` into an InputError.

    Args:
        path: File that the block writes.

    Raises:
        InputError: It cannot be written.
    """
    try:
        yield
    except BrokenPipeError:  # the pipe is one that the block prints to, never the file
        raise
    except OSError as error:
        reason = f"cannot be written ({error.strerror or error})"
        raise InputError(path, reason, "Choose a folder that is writable and has room.") from error


def require_writable(path: Path) -> None:
    """Refuses, before long work, a file that could not be written after it.

    Its folder is made if missing; an existing file does not change.

    Args:
        path: The file to write later.

    Raises:
        InputError: It cannot be written.
    """
    with writing(path), temporary_folder(_target(path).parent):
        pass


def require_writable_folder(folder: Path) -> None:
    """Refuses, before any work, a folder in which no file can be written. It makes none.

    Args:
        folder: The folder, which may have to be made later.

    Raises:
        InputError: Its nearest existing parent is a file, or may not be written to.
    """
    existing = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    with writing(folder):
        if not existing.is_dir():
            raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR))
        if not os.access(existing, os.W_OK | os.X_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))


def _target(path: Path) -> Path:
    """The file that a path leads to, if it may be replaced."""
    if path.exists() and not path.is_file():
        raise InputError(path, "is not a file that can be replaced", "Name a file to write.")
    return Path(os.path.realpath(path))


@contextmanager
def temporary_folder(folder: Path) -> Iterator[Path]:
    """Lends an empty hidden folder in another, which is made if missing.

    It is removed with its content when the block ends. A killed process leaves it behind, and
    :func:`remove_abandoned` removes it.

    Args:
        folder: The other folder.

    Raises:
        OSError: The folder cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    remove_abandoned(folder)
    temporary = folder / f"{PREFIX}{secrets.token_hex(8)}"
    descriptor = _make_locked(temporary)
    try:
        yield temporary
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
        if descriptor is not None:
            os.close(descriptor)


def _make_locked(folder: Path) -> int | None:
    """Makes a folder, and returns the descriptor that holds its lock.

    None if no folder can be opened; then no folder counts as abandoned.
    """
    while True:
        folder.mkdir()
        try:
            descriptor = os.open(folder, os.O_RDONLY)
        except FileNotFoundError:  # another process has removed it as abandoned
            continue
        except PermissionError:  # Windows opens no folders
            return None
        with suppress(OSError):  # a file system without locks
            lock(descriptor, wait=True)
        if os.fstat(descriptor).st_nlink > 0:
            return descriptor
        os.close(descriptor)  # removed as abandoned before the lock


@cache
def remove_abandoned(folder: Path) -> None:
    """Removes what killed processes have left in a folder, once in the life of this process.

    Args:
        folder: The folder, which need not exist.
    """
    for left in folder.glob(f"{PREFIX}*"):
        with suppress(OSError):  # somebody else's, or gone, or on a file system without locks
            descriptor = os.open(left, os.O_RDONLY)
            try:
                if lock(descriptor, wait=False):
                    shutil.rmtree(left) if left.is_dir() else left.unlink()
            finally:
                os.close(descriptor)


def lock(descriptor: int, *, wait: bool) -> bool:
    """Locks an open file or folder, until it is closed, against all others that lock it here.

    Args:
        descriptor: The file or the folder.
        wait: True to wait for another process that holds it.

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
