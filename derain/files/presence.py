"""Whether a file is there, asked without a traceback."""

from pathlib import Path

from derain.files.reading import reading


def is_there(path: Path) -> bool:
    """Whether a path names a file.

    Raises:
        InputError: That cannot be found out: its folder may not be searched, its name is too long.
    """
    with reading(path):
        return path.is_file()
