"""Options that name a method, its parameters and what runs it, the same in every command."""

import argparse
import os
from functools import partial
from pathlib import Path

from derain.bags.names import split
from derain.cli.options import add_threads
from derain.cli.parser import Parser
from derain.default import DEFAULT
from derain.errors import InputError
from derain.example import or_example
from derain.export import methods
from derain.export.runtimes.session import DEFAULT_RUNTIME, FLOAT32_PRECISION, Runtime
from derain.files.format import FORMATS
from derain.files.names import scan_suffix
from derain.files.reading import is_file
from derain.filters import FILTERS
from derain.sources.method import Method
from derain.stores.url import Place, is_url, place_of

# Suffixes of files that name a method, or, as a checkpoint does, are refused as one.
METHOD_SUFFIXES = (".onnx", methods.CHECKPOINT_SUFFIX, *methods.PARAMETER_SUFFIXES)


def list_methods(parser: Parser, of_recordings: bool = True) -> None:
    """Ends the help of a command with the default model and the filters, one a line.

    Args:
        parser: The command's parser.
        of_recordings: True if methods that see several scans are listed too.
    """
    # Listed only for the help: other commands need not look for methods of other packages.
    parser.late_epilog = partial(_listed_methods, of_recordings)


def _listed_methods(of_recordings: bool) -> str:
    model = {DEFAULT: f"see `derain info {DEFAULT}`"}
    parts = [
        ("the model that comes with derain", model),
        ("filters", {name: filter_.HELP for name, filter_ in FILTERS.items()}),
    ]
    if of_recordings:
        from derain.recordings.persistence import PersistenceDerainer  # which imports odometry

        several = {methods.PERSISTENCE: PersistenceDerainer.HELP}
        parts.append(("methods that see several scans of a recording", several))
    lines = []
    for heading, helps in parts:
        width = max(map(len, helps))
        lines.append(f"{heading}:")
        lines += [f"  {name:{width}}  {text}".rstrip() for name, text in helps.items()]
    return "\n".join(lines)


def add_runtime(parser: argparse.ArgumentParser, help: str) -> None:
    """Declares what runs a model's network.

    Args:
        parser: The command's parser.
        help: Use of it by the command.
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


def runtime_of(arguments: argparse.Namespace) -> Runtime:
    """The runtime and the precision that a command line names.

    Raises:
        InputError: No such runtime, or a precision that it does not have.
    """
    return Runtime(arguments.runtime or DEFAULT_RUNTIME, arguments.precision or FLOAT32_PRECISION)


def method_of(method: str, arguments: argparse.Namespace) -> Method:
    """The method that a command line names, ready to judge scans.

    Args:
        method: Its name or file.
        arguments: The options that :func:`add_method_and_scans` declares.

    Raises:
        InputError: No such method, parameters of another, or some that it cannot have.
    """
    runtime = runtime_of(arguments)
    name, parameters = methods.named_method(method)
    file = arguments.parameters
    if file is not None:
        of_method, tuned = methods.read_parameters(file)
        # Models are files, which have more than one name.
        if Path(of_method).resolve() != Path(name).resolve():
            reason = f"holds parameters of {of_method}, not of {name}"
            raise InputError(file, reason, f"Run {of_method} with it.")
        parameters |= tuned
    return methods.load_method(name, parameters | dict(arguments.set), arguments.threads, runtime)


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


def add_method_and_scans(parser: Parser, help: str) -> None:
    """Declares a method, which need not be named, what runs it, and the scans.

    Args:
        parser: The command's parser.
        help: Description of the scans.
    """
    parser.add_argument(
        "method", metavar="[METHOD]", help="ONNX file, YAML file of parameters, or name of a method"
    )
    list_methods(parser)
    add_threads(parser)
    add_runtime(parser, help="runtime of the model")
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
    scans = parser.add_argument("scans", nargs="+", type=place_of, metavar="SCAN", help=help)
    # Where only one word is given it goes to the method, and the words are sorted afterwards. Were
    # it the method that is not required, `run dror --out cleaned scans/` would be misread.
    scans.required = False


def method_and_scans(
    first: str, others: list[Place], command: str = "run", out: str = "cleaned"
) -> tuple[str, list[Place]]:
    """The method and the scans that the words of a command mean.

    Args:
        first: The first word, a method or a scan.
        others: The words after it, scans.
        command: The command, for advice.
        out: Folder of its results, for advice.

    Raises:
        InputError: A first word that is neither, or could be both where that matters; a method
            without scans.
    """
    if is_url(first):
        return DEFAULT, [first, *others]
    path = or_example(Path(first))
    folder, in_bag = os.path.isdir(path), split(path) is not None
    there = folder or in_bag or is_file(path)
    of_method = path.suffix in METHOD_SUFFIXES and not folder
    named = of_method or (not path.suffix and methods.is_method_name(first))
    if not (named or there):
        remedy = f"{methods.method_hint(first)}, and scans after it; or scans alone."
        raise InputError(first, "no such method, file or folder", remedy)
    # Formats come last: to look a suffix up may import what other packages bring.
    if not named and (not others or folder or in_bag or scan_suffix(path) in FORMATS):
        return DEFAULT, [path, *others]
    if others:
        return first, others
    beside = f"`derain {command} {first} SCANS --out {out}`"
    if there and not of_method:
        raise InputError(
            first,
            "it names a method, and also a file or folder here",
            f"Write ./{first} to have that judged by the model that comes with derain, or "
            f"{beside} to have others judged by the method.",
        )
    raise InputError(first, "it is a method, and no scans are named", f"Write {beside}.")
