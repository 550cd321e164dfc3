"""Files of a method's parameters, such as `derain tune` writes."""

from pathlib import Path
from typing import Any

from derain.documents import Entry


def read_parameters(path: str | Path) -> tuple[str, dict[str, Any]]:
    """Reads the name of a method and its parameters.

    Args:
        path: A YAML file that names a ``method``, and parameters of it by name beside it.

    Returns:
        The method, and its parameters as the file has them: texts, finite numbers, true or false.

    Raises:
        InputError: A missing file, or one that names no method.
    """
    document = Entry.of_yaml(Path(path))
    values = document.members()
    if "method" not in values:
        raise document.fault(
            "it names no method", "Write one, such as `method: dsor`, and its parameters by name."
        )
    method = values.pop("method").text()
    return method, {name: entry.scalar() for name, entry in values.items()}
