"""Options of commands that read bags, the same in each."""

import argparse
from pathlib import Path

from derain.bags.names import within
from derain.errors import InputError
from derain.sources.cleaned_bags import BagOptions, CleanedBags
from derain.sources.source import Source


def add_topic(parser: argparse.ArgumentParser) -> None:
    """Declares which topic of a bag is meant."""
    parser.add_argument(
        "--topic", metavar="NAME", help="topic of point clouds, of bags that have several"
    )


def in_topic(paths: list[Path], arguments: argparse.Namespace) -> list[Path]:
    """The paths that a user names, of which those to bags lead to the topic that is meant.

    Raises:
        InputError: A topic, and no bag.
    """
    # Commands that have no such option take the topic in the path.
    return within(paths, getattr(arguments, "topic", None))


def add_cleaned_bags(parser: argparse.ArgumentParser) -> None:
    """Declares what is written of bags."""
    parser.add_argument(
        "--cleaned-topic",
        metavar="NAME",
        help="of a bag, leave its clouds and add a topic of clean ones (default: in their place)",
    )
    parser.add_argument(
        "--removed-topic", metavar="NAME", help="of a bag, add a topic of what was removed"
    )
    parser.add_argument(
        "--keep-shape",
        action="store_true",
        help="of a bag, keep rows and columns of organised clouds: removed points become NaN",
    )


def cleaned_bags(arguments: argparse.Namespace, source: Source) -> CleanedBags:
    """What takes the clouds of whole bags, and writes the bags without rain.

    Raises:
        InputError: Something is in the way of a bag, or options that contradict each other.
    """
    cleaned, removed = arguments.cleaned_topic, arguments.removed_topic
    if cleaned and cleaned == removed:
        raise InputError("--removed-topic", f"{removed} is --cleaned-topic too", "Name another.")
    options = BagOptions(cleaned, removed, arguments.probability, arguments.keep_shape)
    bags = CleanedBags(arguments.out, source, options)
    in_bag = next(filter(bags.takes, source), None)
    if arguments.removed is not None and in_bag is not None:
        raise InputError(
            "--removed",
            f"is a folder for files, and {in_bag.name} is in a bag",
            "Give --removed-topic NAME.",
        )
    return bags
