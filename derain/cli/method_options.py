"""Arguments that name a method, its parameters and what runs it, the same in every command."""

import argparse
from pathlib import Path
from typing import Any

from derain.default import DEFAULT
from derain.errors import InputError
from derain.export.methods import load_method, named_method, read_parameters
from derain.export.runtimes.session import DEFAULT_RUNTIME, FLOAT32_PRECISION, Runtime
from derain.filters import FILTERS
from derain.recordings.registry import METHODS
from derain.sources.method import Method

_MODEL = f"the model that comes with derain:\n  {DEFAULT}  see `derain info {DEFAULT}`"
_FILTERS_HERE, _METHODS_HERE = "{filters}", "{methods}"


def list_filters(parser: argparse.ArgumentParser) -> None:
    """Ends the help of a command with the default model and the filters, one a line."""
    parser.formatter_class = _FilterHelp
    parser.epilog = f"{_MODEL}\nfilters:\n{_FILTERS_HERE}"


def list_methods(parser: argparse.ArgumentParser) -> None:
    """Ends the help of a command with these, and the methods that see several scans."""
    list_filters(parser)
    parser.epilog = f"{parser.epilog}\n{_METHODS_HERE}"


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
        "--parameters", type=Path, metavar="YAML", help="parameters of the method, from derain tune"
    )
    parser.add_argument(
        "--set",
        type=_assignment,
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="set one parameter, over those of --parameters; repeatable",
    )


def add_runtime(parser: argparse.ArgumentParser, help: str) -> None:
    """Declares what runs a model's network.

    Args:
        parser: The command's parser.
        help: What the command does with it.
    """
    parser.add_argument(
        "--runtime",
        metavar="NAME",
        help=f"{help}: {DEFAULT_RUNTIME} (default), or openvino: pip install 'derain[openvino]'",
    )
    parser.add_argument(
        "--precision",
        metavar="NAME",
        help=f"precision of its arithmetic: {FLOAT32_PRECISION} (default), or bf16 if the runtime "
        "and the processor support it",
    )


def runtime_of(name: str | None, precision: str | None) -> Runtime:
    """The runtime and the precision that a command line names.

    Args:
        name: What ``--runtime`` names; None is the default.
        precision: What ``--precision`` names; None is the default.

    Raises:
        InputError: No such runtime, or a precision that it does not have.
    """
    return Runtime(name or DEFAULT_RUNTIME, precision or FLOAT32_PRECISION)


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


class _FilterHelp(argparse.RawDescriptionHelpFormatter):
    """Makes the list when help is asked for.

    Every start of derain makes every parser, and most starts need not look for what other packages
    bring.
    """

    def add_text(self, text: str | None) -> None:
        """Adds a text to the help, with the lists in place of their marks."""
        if text and _FILTERS_HERE in text:
            text = text.replace(_FILTERS_HERE, _listed({n: f.HELP for n, f in FILTERS.items()}))
        if text and _METHODS_HERE in text:
            listed = _listed({name: method.HELP for name, method in METHODS.items()})
            heading = "methods that see several scans of a recording:\n" if listed else ""
            text = text.replace(_METHODS_HERE, heading + listed)
        super().add_text(text)


def _listed(helps: dict[str, str]) -> str:
    """Names, a line each, and what stands for each."""
    width = max(map(len, helps), default=0)
    return "\n".join(f"  {name:{width}}  {help_}".rstrip() for name, help_ in helps.items())
