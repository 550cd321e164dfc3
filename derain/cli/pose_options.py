"""The option that says where the poses of scans come from, the same in every command."""

import argparse

from derain.odometry.posed import ODOMETRY, STANDING, with_poses
from derain.sources.source import Source


def add_poses(parser: argparse._ActionsContainer) -> None:
    """Declares where poses come from, as :func:`derain.odometry.posed.with_poses` takes it."""
    poses = parser.add_mutually_exclusive_group()
    poses.add_argument(
        "--poses",
        metavar="POSES",
        help=f"poses of the scans: a file in KITTI's or TUM's form, a folder with <sequence>.txt "
        f"for each sequence, {STANDING}, or {ODOMETRY} (default: poses.txt beside the scans, else "
        "as the method finds them)",
    )
    poses.add_argument(
        "--standing",
        dest="poses",
        action="store_const",
        const=STANDING,
        help=f"the sensor stood still: --poses {STANDING}",
    )


def placed(source: Source, arguments: argparse.Namespace) -> Source:
    """The same frames at the poses that the arguments name; as they are where they name none.

    Raises:
        InputError: Poses that cannot be read or do not fit the scans.
    """
    if arguments.poses is None:
        return source
    return with_poses(source, arguments.poses, arguments.threads)
