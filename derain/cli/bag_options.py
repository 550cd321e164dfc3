"""Options of commands that read bags, the same in each."""

import argparse
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from derain.sources.cleaned_bags import BagOptions


def add_topic(parser: argparse.ArgumentParser) -> None:
    """Declares which topic of a bag is meant."""
    parser.add_argument(
        "--topic", metavar="NAME", help="topic of point clouds, for bags with several"
    )


def add_cleaned_bags(parser: argparse.ArgumentParser) -> None:
    """Declares what is written of bags."""
    parser.add_argument(
        "--cleaned-topic",
        metavar="NAME",
        help="bags: add a topic of clean clouds (default: replace the clouds)",
    )
    parser.add_argument(
        "--removed-topic", metavar="NAME", help="bags: add a topic of the removed points"
    )
    parser.add_argument(
        "--keep-shape",
        action="store_true",
        help="bags: keep rows and columns of organised clouds; removed points become NaN",
    )


def bag_options(arguments: argparse.Namespace) -> "BagOptions":
    """What the arguments have written of bags."""
    from derain.sources.cleaned_bags import BagOptions

    return BagOptions(arguments.cleaned_topic, arguments.removed_topic, arguments.keep_shape)
