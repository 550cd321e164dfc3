"""Libraries that a benchmark compares derain with, as far as they are installed."""

import importlib
from types import ModuleType


def installed(name: str) -> ModuleType | None:
    """A module by its name; None where it is not installed."""
    try:
        return importlib.import_module(name)
    except ImportError:
        return None
