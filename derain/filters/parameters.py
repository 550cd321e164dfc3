"""Files of a method's parameters, such as `derain tune` writes."""

from pathlib import Path
from typing import Any

import yaml

from derain.errors import InputError
from derain.files.reading import reading


def read_parameters(path: str | Path) -> tuple[str, dict[str, Any]]:
    """Reads the name of a method and its parameters.

    Args:
        path: A YAML file that names a ``method``, and parameters of it by name beside it.

    Returns:
        The method, and its parameters as the file has them.

    Raises:
        InputError: A missing file, or one that names no method.
    """
    path = Path(path)
    with reading(path):
        text = path.read_bytes()
    try:
        content = yaml.safe_load(text)
        method = content.pop("method")
        if not all(isinstance(name, str) for name in (method, *content)):
            raise ValueError("names must be text")
    except (yaml.YAMLError, ValueError, LookupError, TypeError, AttributeError) as error:
        raise InputError(
            path,
            f"not a file of parameters ({error})",
            "It needs a method, such as `method: dsor`, and its parameters by name.",
        ) from error
    return method, content
