"""Files of a method's parameters, such as `derain tune` writes."""

from pathlib import Path
from typing import Any

from derain.files.documents import Entry
from derain.files.reading import is_file
from derain.views.candidates import candidates_at

# What bounds are called among the parameters of a filter; they are the same for every one.
CANDIDATES = "candidates"


def read_parameters(path: str | Path) -> tuple[str, dict[str, Any]]:
    """Reads the name of a method and its parameters.

    Args:
        path: A YAML file that names a ``method``, and parameters of it by name beside it.

    Returns:
        The method, and its parameters as the file has them: texts, finite numbers, true or false;
        ``candidates``, if there are any, as such.
        A model is sought from the file's own folder first, wherever the command runs; where it is
        not there, its name stays as it is.

    Raises:
        InputError: A missing file, one that names no method, or candidates that are none.
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
    return named, {
        name: candidates_at(entry) if name == CANDIDATES else entry.scalar()
        for name, entry in values.items()
    }
