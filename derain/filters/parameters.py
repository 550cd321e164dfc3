"""Files of a method's parameters, such as `derain tune` writes."""

from pathlib import Path
from typing import Any

from derain.files.documents import Entry
from derain.files.reading import is_file


def read_parameters(path: str | Path) -> tuple[str, dict[str, Any]]:
    """Reads the name of a method and its parameters.

    Args:
        path: A YAML file that names a ``method``, and parameters of it by name beside it.

    Returns:
        The method, and its parameters as the file has them: texts, finite numbers, true or false.
        A model is sought from the file's own folder first, wherever the command runs; where it is
        not there, its name stays as it is.

    Raises:
        InputError: A missing file, or one that names no method.
    """
    path = Path(path)
    document = Entry.of_yaml(path)
    values = document.members()
    if "method" not in values:
        raise document.fault(
            "it names no method", "Write one, such as `method: dsor`, and its parameters by name."
        )
    method = values.pop("method").text()
    beside = path.parent / method
    named = str(beside) if Path(method).suffix and is_file(beside) else method
    return named, {name: entry.scalar() for name, entry in values.items()}
