"""Arguments that name labelled scans, the same in every command that measures."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from derain.bags.names import within
from derain.cards.card import packaged_cards
from derain.cli.bag_options import add_topic
from derain.cli.scan_options import add_columns, add_intensity_scale

if TYPE_CHECKING:
    from derain.datamodules.scan_data import ScanData


def add_data_arguments(parser: argparse.ArgumentParser, part: str) -> None:
    """Declares them.

    Args:
        parser: The command's parser.
        part: Part of a data set that the command takes by default.
    """
    parser.add_argument(
        "--data",
        type=Path,
        nargs="+",
        required=True,
        help="labelled scans and folders of them (labels beside them or in ../labels), "
        "or the root of one data set",
    )
    parser.add_argument(
        "--part",
        choices=("train", "validation", "test"),
        default=part,
        help="part of a data set (default: %(default)s)",
    )
    parser.add_argument(
        "--card",
        help=f"data card with the meaning of the labels: {', '.join(packaged_cards())} (derain: "
        "from simulate --on), or a YAML file (default: found by the data set's folders)",
    )
    add_columns(parser)
    add_intensity_scale(parser)
    add_topic(parser)


def labelled(arguments: argparse.Namespace, paths: list[Path]) -> "ScanData":
    """The labelled scans that these arguments, and some paths, name.

    Raises:
        InputError: Data whose labels nothing explains, or a root without sequences.
    """
    from derain.datamodules.labelled import card_of, labelled_scans
    from derain.datamodules.loading import Loading

    loading = Loading(
        columns=arguments.columns,
        intensity_scale=arguments.intensity_scale,
        deduplicate=getattr(arguments, "distinct", None),
    )
    # A command without the option takes the topic in the path.
    paths = within(paths, getattr(arguments, "topic", None))
    return labelled_scans(paths, card_of(paths, arguments.card), loading)
