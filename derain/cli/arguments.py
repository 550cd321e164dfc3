"""Types of command line arguments, which refuse impossible values before any work."""

import argparse
import math
import shlex
from collections.abc import Callable
from pathlib import Path

from derain.errors import printable

# Flags that can be given as --no-..., by the name that argparse gives their values.
DENIABLE = ("distinct",)


def whole(text: str) -> int:
    """A whole number."""
    try:
        return int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text} is not a whole number") from None


def number(text: str) -> float:
    """A finite number."""
    value = _float(text)
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"{text} is not a number")
    return value


def count(text: str) -> int:
    """A whole number of 1 or more."""
    return _at_least(1, text)


def threads(text: str) -> int:
    """A number of threads; 0 stands for every core."""
    return _at_least(0, text)


def add_threads(parser: argparse.ArgumentParser) -> None:
    """Declares how many threads a command may use."""
    parser.add_argument("--threads", type=threads, default=0, help="threads (default: all cores)")


def factor(text: str) -> float:
    """A finite number above 0."""
    value = _float(text)
    if not (value > 0 and math.isfinite(value)):
        raise argparse.ArgumentTypeError(f"{text} is not a number above 0")
    return value


def share(text: str) -> float:
    """A number from 0 to 1."""
    value = _float(text)
    if not 0 <= value <= 1:
        raise argparse.ArgumentTypeError(f"{text} is not a number from 0 to 1")
    return value


def file_named(*suffixes: str) -> Callable[[str], Path]:
    """A file to write, with a suffix by which other commands know its kind.

    Args:
        suffixes: The suffixes that it may have.
    """

    def path(text: str) -> Path:
        if Path(text).suffix not in suffixes:
            raise argparse.ArgumentTypeError(f"{text} does not end in {' or '.join(suffixes)}")
        return Path(text)

    return path


def command_line(arguments: argparse.Namespace, positional: str | None = None) -> str:
    """The command line of some parsed arguments, defaults included.

    Args:
        arguments: The parsed arguments, with the name of the command.
        positional: Name of the positional argument, if there is one.
    """
    words = ["derain", arguments.command]
    for name, value in vars(arguments).items():
        if name == "command" or value is None or (value is False and name not in DENIABLE):
            continue
        if name != positional:
            words.append(f"--{'no-' if value is False else ''}{name.replace('_', '-')}")
        if isinstance(value, tuple):  # names between commas
            words.append(",".join(value))
        elif isinstance(value, list):
            words += map(str, value)
        elif not isinstance(value, bool):
            words.append(str(value))
    return printable(shlex.join(words))


def _float(text: str) -> float:
    """The number that a text is; NaN where it is none."""
    try:
        return float(text)
    except ValueError:
        return math.nan


def _at_least(least: int, text: str) -> int:
    value = whole(text)
    if value < least:
        raise argparse.ArgumentTypeError(f"{text} is less than {least}")
    return value
