"""Arguments that name a method and its parameters, the same in every command that runs one."""

import argparse
from pathlib import Path
from typing import Any

from derain.cli.filter_help import list_methods
from derain.cli.runtime_options import runtime_of
from derain.errors import InputError
from derain.export.methods import load_method, named_method
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
        "--parameters", type=Path, metavar="YAML", help="the method's parameters, as tuned"
    )
    parser.add_argument(
        "--set",
        type=_assignment,
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="one parameter of the method, over those of --parameters; may be given again",
    )


def method_of(arguments: argparse.Namespace) -> Method:
    """The method that the arguments name, ready to judge scans.

    Raises:
        InputError: No such method, parameters of another, or some that it cannot have.
    """
    runtime = runtime_of(arguments)
    return load_method(*_named_method(arguments), arguments.threads, runtime)


def _named_method(arguments: argparse.Namespace) -> tuple[str, dict[str, Any]]:
    """The method, and its parameters: those of the files, and over them those set one by one."""
    name, parameters = named_method(arguments.method)
    if arguments.parameters is not None:
        method, tuned = read_parameters(arguments.parameters)
        # Models are files, which have more than one name.
        if Path(method).resolve() != Path(name).resolve():
            raise InputError(
                arguments.parameters,
                f"holds parameters of {method}, not of {name}",
                f"Run {method} with it.",
            )
        parameters |= tuned
    return name, parameters | dict(arguments.set)


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
