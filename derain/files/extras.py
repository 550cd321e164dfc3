"""Libraries that only some formats need, and that are therefore installed on demand."""

import importlib
from pathlib import Path
from types import ModuleType

from derain.errors import InputError
from derain.files.names import scan_suffix


def import_extra(library: str, extra: str, path: Path) -> ModuleType:
    """Imports the library of a format.

    Args:
        library: Name of the module.
        extra: Name of derain's extra that installs it.
        path: The file that needs it, for the message.

    Raises:
        InputError: It is not installed.
    """
    try:
        return importlib.import_module(library)
    except ImportError as error:
        raise InputError(
            path,
            f"{scan_suffix(path)} needs {library}, which is not installed ({error})",
            f"pip install 'derain[{extra}]'.",
        ) from error
