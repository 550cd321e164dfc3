"""The option that says where the poses of scans come from, the same in every command."""

import argparse

from derain.recordings.posed import ODOMETRY, STANDING


def add_poses(parser: argparse._ActionsContainer) -> None:
    """Declares where poses come from, as :func:`derain.recordings.posed.with_poses` takes it."""
    parser.add_argument(
        "--poses",
        metavar="POSES",
        help=f"poses of the scans: a file in the format of KITTI or TUM, a folder with one "
        f"<sequence>.txt per sequence, {STANDING}, or {ODOMETRY} (default: poses.txt beside the "
        f"scans, otherwise {ODOMETRY})",
    )
