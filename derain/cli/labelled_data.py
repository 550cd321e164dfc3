"""Arguments that name labelled scans, the same in every command that measures."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from derain.bags.names import within
from derain.cards.card import packaged_cards
from derain.cli.scan_options import add_columns, add_intensity_scale, add_topic

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


def labelled(
    paths: Sequence[Path],
    card: str | None,
    columns: tuple[str, ...],
    intensity_scale: float,
    *,
    topic: str | None = None,
    distinct: bool | None = None,
) -> "ScanData":
    """The labelled scans that a command line names.

    Args:
        paths: Scans and folders of them, or the root of one data set.
        card: Name or file of their data card; None finds it by their folders.
        columns: Names of the columns of files that do not name them.
        intensity_scale: Factor from the scans' intensities to the unit of the data card.
        topic: Topic of point clouds in bags; None where the paths name it.
        distinct: Whether points at one position count once; None follows the data card.

    Raises:
        InputError: Data whose labels nothing explains, or a root without sequences.
    """
    from derain.datamodules.labelled import card_of, labelled_scans
    from derain.datamodules.scan_data import Loading

    loading = Loading(columns=columns, intensity_scale=intensity_scale, deduplicate=distinct)
    paths = within(paths, topic)
    return labelled_scans(paths, card_of(paths, card), loading)
