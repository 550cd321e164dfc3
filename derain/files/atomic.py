"""Writing a file whole or not at all."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from derain.errors import InputError
from derain.files.temporary import temporary_beside


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
        with temporary_beside(target) as temporary:
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
