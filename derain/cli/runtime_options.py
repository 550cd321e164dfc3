"""Arguments that say what runs a model's network."""

import argparse

from derain.export.runtimes.registry import DEFAULT_RUNTIME, Runtime
from derain.export.runtimes.session import FLOAT32_PRECISION


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
