"""Options that set how scans are read, the same in every command."""

import argparse

from derain.cli.arguments import factor
from derain.files import DEFAULT_COLUMNS
from derain.files.format import FORMATS
from derain.recordings.posed import ODOMETRY, STANDING


def column_names(text: str) -> tuple[str, ...]:
    """Names of columns, between commas."""
    return tuple(text.split(","))


def add_columns(
    parser: argparse._ActionsContainer,
    option: str = "--columns",
    of: str = "",
    default: tuple[str, ...] | None = DEFAULT_COLUMNS,
) -> None:
    """Declares the names of the columns of files that do not name them.

    Args:
        parser: The command's parser, or a group of its arguments.
        option: What the option is called.
        of: Whose files they are, where a command reads several kinds.
        default: What it is where it is not given; None leaves that to the command.
    """
    action = parser.add_argument(
        option,
        type=column_names,
        metavar="NAMES",
        default=default,
        help=f"column names for {of}files without them: %(unnamed)s "
        f"(default: {','.join(DEFAULT_COLUMNS)})",
    )
    vars(action)["unnamed"] = _UnnamedFormats()


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
    """Declares where poses come from, as :func:`derain.recordings.posed.with_poses` takes it."""
    parser.add_argument(
        "--poses",
        metavar="POSES",
        help=f"poses of the scans: a file in the format of KITTI or TUM, a folder with one "
        f"<sequence>.txt per sequence, {STANDING}, or {ODOMETRY} (default: poses.txt beside the "
        f"scans, otherwise {ODOMETRY})",
    )


class ListFormats(argparse.Action):
    """Option that prints the formats of scan files that there are, and ends the command."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        """Does so."""
        print(formats_of_scans())
        parser.exit()


def formats_of_scans() -> str:
    """The formats of scan files that there are, a line each."""
    suffixes: dict[str, list[str]] = {}
    for suffix, format_ in FORMATS.items():
        needs = f" (needs derain[{format_.EXTRA.name}])" if format_.EXTRA else ""
        suffixes.setdefault(format_.HELP + needs, []).append(suffix)
    lines = [f"  {', '.join(names):<24}{what}" for what, names in suffixes.items()]
    return "\n".join(("formats of scans, each of them also compressed as .gz:", *lines))


class _UnnamedFormats:
    """Which files do not name their columns, format by format.

    A text that is made when help shows it, for other packages are asked what formats they bring.
    """

    def __str__(self) -> str:
        return ", ".join(sorted({format_.UNNAMED for format_ in FORMATS.values()} - {""}))
