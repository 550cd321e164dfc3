"""Arguments that name a method and its parameters, the same in every command that runs one."""

import argparse
from pathlib import Path
from typing import Any

from derain.cli.filter_help import list_methods
from derain.errors import InputError
from derain.export.methods import load_method, named_method
from derain.export.runtimes.registry import Runtime
from derain.filters import read_parameters
from derain.sources.method import Method


def add_method(parser: argparse.ArgumentParser, metavar: str = "METHOD") -> None:
    """Declares the method, and lists in the help which there are.

    Args:
        parser: The command's parser.
        metavar: What the method is called in the help.
    """
    parser.add_argument(
        "method", metavar=metavar, help="ONNX file, YAML file of parameters, or name of a method"
    )
    list_methods(parser)


def add_parameters(parser: argparse.ArgumentParser) -> None:
    """Declares the method's parameters."""
    parser.add_argument(
        "--parameters",
        type=Path,
        metavar="YAML",
        help="parameters of the method, from derain tune",
    )
    parser.add_argument(
        "--set",
        type=_assignment,
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="set one parameter, over those of --parameters; repeatable",
    )


def method_of(
    method: str, file: Path | None, settings: dict[str, Any], threads: int, runtime: Runtime
) -> Method:
    """The method that a command line names, ready to judge scans.

    Args:
        method: Its name or file.
        file: File of parameters, over those of the method's own file; None where there is none.
        settings: Single parameters, over those of the files.
        threads: Threads to use; 0 takes all cores.
        runtime: What runs a model's network.

    Raises:
        InputError: No such method, parameters of another, or some that it cannot have.
    """
    name, parameters = named_method(method)
    if file is not None:
        of_method, tuned = read_parameters(file)
        # Models are files, which have more than one name.
        if Path(of_method).resolve() != Path(name).resolve():
            raise InputError(
                file, f"holds parameters of {of_method}, not of {name}", f"Run {of_method} with it."
            )
        parameters |= tuned
    return load_method(name, parameters | settings, threads, runtime)


def _assignment(text: str) -> tuple[str, int | float | str]:
    """A parameter's name and value: a number where it reads as one."""
    name, equals, value = text.partition("=")
    if not (name and equals and value):
        raise argparse.ArgumentTypeError(f"{text} is not NAME=VALUE")
    for kind in (int, float):
        try:
            return name, kind(value)
        except ValueError:
            continue
    return name, value
