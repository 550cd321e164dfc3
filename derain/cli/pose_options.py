"""The option that says where the poses of scans come from, the same in every command."""

import argparse

from derain.odometry.posed import ODOMETRY, STANDING, with_poses
from derain.sources.source import Source


def add_poses(parser: argparse._ActionsContainer) -> None:
    """Declares where poses come from, as :func:`derain.odometry.posed.with_poses` takes it."""
    parser.add_argument(
        "--poses",
        metavar="POSES",
        help=f"poses of the scans: a file in KITTI's or TUM's form, a folder with <sequence>.txt "
        f"for each sequence, {STANDING}, or {ODOMETRY} (default: poses.txt beside the scans, else "
        f"{ODOMETRY})",
    )


def placed(source: Source, arguments: argparse.Namespace) -> Source:
    """The same frames, where the option says that they were taken.

    Without it they are as they were: a method that needs poses takes those beside the scans, or
    finds them as it goes.

    Raises:
        InputError: Poses that cannot be read or do not fit the scans.
    """
    return source if arguments.poses is None else with_poses(source, arguments.poses)
