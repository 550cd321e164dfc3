"""Arguments that say where the sensor was, the same in every command that takes recordings."""

import argparse
from pathlib import Path

from derain.sources.placing import along, standing
from derain.sources.source import Source


def add_poses(parser: argparse.ArgumentParser) -> None:
    """Declares them."""
    poses = parser.add_mutually_exclusive_group()
    poses.add_argument(
        "--poses",
        type=Path,
        metavar="FILE",
        help="where the sensor was at each scan, as `derain odometry` writes it "
        "(default: the poses.txt beside the scans, if there is one)",
    )
    poses.add_argument(
        "--standing", action="store_true", help="the sensor stood still throughout each recording"
    )


def placed(source: Source, arguments: argparse.Namespace) -> Source:
    """The same frames, where the arguments say that they were taken.

    Raises:
        InputError: Poses that cannot be read or do not fit the scans.
    """
    if arguments.poses is not None:
        return along(source, arguments.poses)
    return standing(source) if arguments.standing else source
