"""Reads ``[METHOD] SCAN...``: whether the first word names a method, or is a scan already."""

import argparse
import os
from pathlib import Path

from derain.bags.names import split
from derain.cli.method_options import add_method
from derain.default import DEFAULT
from derain.errors import InputError
from derain.export.methods import CHECKPOINT_SUFFIX, PARAMETER_SUFFIXES, is_method_name, method_hint
from derain.files.format import FORMATS
from derain.files.names import scan_suffix
from derain.files.reading import is_file

# Suffixes of files that name a method, or, as a checkpoint does, are refused as one.
METHOD_SUFFIXES = (".onnx", CHECKPOINT_SUFFIX, *PARAMETER_SUFFIXES)

# The same for the help of a command.
RULE = """\
METHOD is optional: if the first word is a folder or a scan, the model that comes with derain cleans
all scans. Write ./crf for a folder called crf."""


def add_method_and_scans(parser: argparse.ArgumentParser, *, help: str) -> None:
    """Declares a method, which need not be named, and the scans.

    Args:
        parser: The command's parser.
        help: What the scans are.
    """
    add_method(parser, metavar="[METHOD]")
    scans = parser.add_argument("scans", nargs="+", type=Path, metavar="SCAN", help=help)
    # Where only one word is given it goes to the method, and the words are sorted afterwards. Were
    # it the method that is not required, `run dror --out cleaned scans/` would be misread.
    scans.required = False


def method_and_scans(first: str, others: list[Path], command: str) -> tuple[str, list[Path]]:
    """The method and the scans that a command line means.

    Args:
        first: The first word, a method or a scan.
        others: The words after it, scans.
        command: Name of the command.

    Raises:
        InputError: A first word that is neither, or could be both where that matters; a method
            without scans.
    """
    named, there = (
        _names_method(first),
        os.path.isdir(first) or is_file(Path(first)) or _in_bag(first),
    )
    if not (named or there):
        raise InputError(
            first, "no such file", f"{method_hint(first)}, and scans after it; or scans alone."
        )
    if not named and (not others or _may_be_scans(first)):
        return DEFAULT, [Path(first), *others]
    if others:
        return first, others
    beside = f"`derain {command} {first} SCANS --out cleaned`"
    if there and not _is_method_file(first):
        raise InputError(
            first,
            "it is a method's name, and a file or folder here has it, too",
            f"Write ./{first} to have that cleaned by the model that comes with derain, or "
            f"{beside} to clean others by the method.",
        )
    raise InputError(first, "it is a method, and no scans are named", f"Write {beside}.")


def _may_be_scans(word: str) -> bool:
    """Whether a folder or a file, which is no method by its name, may be scans by its name."""
    return os.path.isdir(word) or scan_suffix(Path(word)) in FORMATS or _in_bag(word)


def _in_bag(word: str) -> bool:
    """Whether a word is a bag, or leads into one."""
    return split(Path(word)) is not None


def _names_method(word: str) -> bool:
    """Whether a word is a method's name, or a file of a kind that holds methods."""
    return _is_method_file(word) or (not Path(word).suffix and is_method_name(word))


def _is_method_file(word: str) -> bool:
    return Path(word).suffix in METHOD_SUFFIXES and not os.path.isdir(word)
