"""Reads a file; any fault is one InputError."""

import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from derain.errors import InputError, reason_of
from derain.files.names import scan_suffix


@contextmanager
def reading(path: Path, *damage: type[Exception]) -> Iterator[None]:
    """Turns the errors of reading `path` into an InputError.

    Args:
        path: The file that the block reads.
        damage: Exceptions of the format's library on damaged content.

    Raises:
        InputError: The file is missing, cannot be opened, is damaged, or needs more memory than
            there is.
    """
    try:
        yield
    except (InputError, BrokenPipeError):  # the pipe that the block prints to, not the file
        raise
    except damage as error:
        reason = f"cannot be read as {scan_suffix(path)} ({reason_of(error)})"
        remedy = "The file is damaged or of another format; write it again."
        raise InputError(path, reason, remedy) from error
    except FileNotFoundError as error:
        raise InputError(path, "there is no such file", "Check the path.") from error
    except OSError as error:
        reason = f"cannot be read ({error.strerror or error})"
        raise InputError(path, reason, "Check the file and its permissions.") from error
    except MemoryError as error:
        reason = "needs more memory than is available"
        raise InputError(path, reason, "Cut it into smaller scans.") from error


def read_bytes(path: Path, largest: int) -> bytes:
    """The content of a regular file. Pipes and devices are not opened, because they may never end.

    Args:
        path: The file.
        largest: Bytes that it may have.

    Raises:
        InputError: No regular file.
        OSError: The file cannot be read.
        ValueError: It is larger.
    """
    size = file_size(path)
    if size > largest:
        raise ValueError(f"{size:,} bytes, more than {largest:,}")
    with path.open("rb") as file:
        return file.read(size)


def file_size(path: Path) -> int:
    """Bytes of a regular file.

    Raises:
        InputError: No regular file.
        OSError: There is no file, or its folder may not be searched.
    """
    status = path.stat()
    if not stat.S_ISREG(status.st_mode):
        raise InputError(path, "is a folder, a pipe or a device", "Name a file.")
    return status.st_size


def stamp_of(path: Path) -> str:
    """Size in bytes and time of change in nanoseconds of a file, which change when it does.

    Raises:
        InputError: There is no such file.
    """
    with reading(path):
        status = path.stat()
    return f"{status.st_size}-{status.st_mtime_ns}"


def is_file(path: Path) -> bool:
    """True if there is such a file.

    Raises:
        InputError: That cannot be known: a name longer than any file's, or a folder that may not be
            searched.
    """
    with reading(path):
        return path.is_file()
