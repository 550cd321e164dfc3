"""Reading a file, with one error for whatever is wrong with it."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from derain.errors import InputError


@contextmanager
def reading(path: Path, *damage: type[Exception]) -> Iterator[None]:
    """Turns the errors of reading `path` into an InputError.

    Args:
        path: The file that the block reads.
        damage: What the format's library raises on content that it cannot read.

    Raises:
        InputError: The file is missing, cannot be opened or is damaged.
    """
    try:
        yield
    except FileNotFoundError as error:
        raise InputError(path, "there is no such file", "Check the path.") from error
    except IsADirectoryError as error:
        raise InputError(path, "is a folder", "Name a file.") from error
    except OSError as error:
        raise InputError(
            path,
            f"cannot be read ({error.strerror or error})",
            "Check the file and its permissions.",
        ) from error
    except damage as error:
        reason = " ".join(str(error).split())
        raise InputError(
            path,
            f"cannot be read as {path.suffix} ({reason})",
            "The file is damaged or of another format; write it again.",
        ) from error
