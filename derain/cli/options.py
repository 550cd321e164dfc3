"""Options that several commands have, each declared and read in one way.

Types refuse impossible values before any work.
"""

import argparse
import math
import shlex
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from derain.cards.card import packaged_cards
from derain.cli.parser import number, whole
from derain.errors import InputError, printable
from derain.files import DEFAULT_COLUMNS
from derain.recordings.posed import STANDING
from derain.scan import Scan
from derain.sources.frame import Frame

if TYPE_CHECKING:
    from derain.datamodules.labelled import LabelledScans

# Suffixes of the formats of pictures that commands write.
PICTURES = (".png", ".jpg", ".jpeg", ".pdf", ".svg", ".eps", ".tif", ".tiff", ".webp")


def count(text: str, least: int = 1, most: float = math.inf) -> int:
    """A whole number of 1 or more."""
    value = whole(text)
    if value < least:
        raise argparse.ArgumentTypeError(f"{text} is less than {least}")
    if value > most:
        raise argparse.ArgumentTypeError(f"{text} is more than {most}")
    return value


def none_or_more(text: str) -> int:
    """A whole number of 0 or more."""
    return count(text, least=0)


def factor(text: str) -> float:
    """A finite number above 0."""
    value = number(text)
    if value <= 0:
        raise argparse.ArgumentTypeError(f"{text} is not a number above 0")
    return value


def share(text: str) -> float:
    """A number from 0 to 1."""
    value = number(text)
    if not 0 <= value <= 1:
        raise argparse.ArgumentTypeError(f"{text} is not a number from 0 to 1")
    return value


def column_names(text: str) -> tuple[str, ...]:
    """Names of columns, between commas."""
    return tuple(text.split(","))


def picture(text: str) -> Path:
    """A picture to write, whose suffix may be in capitals."""
    file_named(*PICTURES)(text.lower())
    return Path(text)


def file_named(*suffixes: str) -> Callable[[str], Path]:
    """A file to write, with a suffix that other commands accept.

    Args:
        suffixes: The suffixes that it may have.
    """

    def path(text: str) -> Path:
        if Path(text).suffix not in suffixes:
            raise argparse.ArgumentTypeError(f"{text} does not end in {' or '.join(suffixes)}")
        return Path(text)

    return path


def add_threads(parser: argparse.ArgumentParser) -> None:
    """Declares how many threads a command may use."""
    parser.add_argument(
        "--threads", type=none_or_more, default=0, help="threads (default: all cores)"
    )


def add_seed(parser: argparse.ArgumentParser) -> None:
    """Declares ``--seed``."""
    parser.add_argument("--seed", type=none_or_more, default=0, help="random seed (default: 0)")


def add_json(parser: argparse.ArgumentParser) -> None:
    """Declares that what is printed of each scan is an object."""
    parser.add_argument("--json", action="store_true", help="print one JSON object per scan")


def add_columns(
    parser: argparse._ActionsContainer,
    option: str = "--columns",
    of: str = "",
    default: tuple[str, ...] | None = DEFAULT_COLUMNS,
) -> None:
    """Declares the names of the columns of files that do not name them.

    Args:
        parser: The command's parser, or a group of its arguments.
        option: Name of the option.
        of: Whose files they are, where a command reads several kinds.
        default: Its default; None leaves that to the command.
    """
    parser.add_argument(
        option,
        type=column_names,
        metavar="NAMES",
        default=default,
        help=f"column names for {of}files without them, such as .bin "
        f"(default: {','.join(DEFAULT_COLUMNS)})",
    )


def read_by(frame: Frame, option: str) -> Scan:
    """Reads a frame whose columns an option names that is not ``--columns``.

    Raises:
        InputError: A scan that cannot be read; the remedy names that option.
    """
    try:
        return frame.read()
    except InputError as error:
        raise error.renaming_option("--columns", option) from error


def add_intensity_scale(parser: argparse.ArgumentParser, of: str = "") -> None:
    """Declares the factor from the scans' intensities to the unit of the methods.

    Args:
        parser: The command's parser.
        of: Which scans they are, where a command reads several kinds.
    """
    parser.add_argument(
        "--intensity-scale",
        type=factor,
        default=1.0,
        metavar="FACTOR",
        help=f"multiply the {of}scans' intensities by FACTOR, e.g. 255 (default: 1)",
    )


def add_topic(parser: argparse.ArgumentParser) -> None:
    """Declares the topic to read of a bag."""
    parser.add_argument(
        "--topic", metavar="NAME", help="topic of point clouds, for bags with several"
    )


def add_poses(parser: argparse.ArgumentParser) -> None:
    """Declares the source of poses, for :func:`derain.recordings.posed.with_poses`."""
    parser.add_argument(
        "--poses",
        metavar="POSES",
        help=f"poses of the scans: a file in the format of KITTI or TUM, a folder with one "
        f"<sequence>.txt per sequence, or {STANDING} (default: poses.txt beside the scans, "
        "otherwise computed from the scans)",
    )


def add_data(parser: argparse.ArgumentParser, part: str) -> None:
    """Declares the labelled scans that a command measures on, as :func:`labelled` reads them.

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
    paths: Sequence[Path], arguments: argparse.Namespace, topic: str | None = None
) -> "LabelledScans":
    """The labelled scans that a command line names.

    Args:
        paths: Scans and folders of them, or the root of one data set.
        arguments: The options, of which those for the data card, the columns and the scale of
            intensities are used.
        topic: Topic of point clouds in bags; None where the paths name it.

    Raises:
        InputError: Data whose labels nothing explains, or a root without sequences.
    """
    from derain.datamodules.labelled import card_of, labelled_scans
    from derain.datamodules.scan_data import Loading

    loading = Loading(columns=arguments.columns, intensity_scale=arguments.intensity_scale)
    return labelled_scans(paths, card_of(paths, arguments.card), loading, topic)


def command_line(
    arguments: argparse.Namespace, positional: str | None = None, without: Sequence[str] = ()
) -> str:
    """The command line of some parsed arguments, defaults included.

    Args:
        arguments: The parsed arguments, with the name of the command.
        positional: Name of the positional argument, if there is one.
        without: Names of arguments that change no result, and of all flags.
    """
    words = ["derain", arguments.command]
    for name, value in vars(arguments).items():
        if name in ("command", *without) or value is None:
            continue
        if name != positional:
            words.append(f"--{name.replace('_', '-')}")
        if isinstance(value, tuple):  # names between commas
            words.append(",".join(value))
        elif isinstance(value, list):
            words += map(str, value)
        else:
            words.append(str(value))
    return printable(shlex.join(words))
