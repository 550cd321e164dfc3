"""Small YAML files that come with derain, and how a user names one of them or one of their own."""

from collections.abc import Mapping
from importlib import resources
from pathlib import Path

from derain.errors import InputError, did_you_mean
from derain.files.reading import is_file


def packaged(package: str, folder: str = "") -> dict[str, Path]:
    """The YAML files of a package, by name, sorted: each is found by being there.

    Args:
        package: Name of the package, such as ``derain.cards``.
        folder: Folder within it, where they do not lie beside the package's modules.
    """
    files = Path(str(resources.files(package))) / folder
    return {file.stem: file for file in sorted(files.glob("*.yaml"))}


def packaged_or_own(name: str | Path, files: Mapping[str, Path], kind: str) -> Path:
    """The file that a user names.

    Args:
        name: Name of a packaged file, or the path of one of the user's own.
        files: The packaged ones, by name.
        kind: What they are, such as "sensor", for the message.

    Raises:
        InputError: There is no such file.
    """
    path = files.get(str(name), Path(name))
    if not is_file(path):
        remedy = f"{did_you_mean(name, files)}Give a YAML file or one of {', '.join(files)}."
        raise InputError(name, f"no such {kind}", remedy)
    return path
