"""The option that says where the poses of scans come from, the same in every command."""

import argparse

from tqdm import tqdm

from derain.odometry.posed import ODOMETRY, STANDING, with_poses
from derain.odometry.registration import Registration
from derain.sources.frame import Frame
from derain.sources.source import Source
from derain.system.notices import Notices


def add_poses(parser: argparse._ActionsContainer) -> None:
    """Declares where poses come from, as :func:`derain.odometry.posed.with_poses` takes it."""
    parser.add_argument(
        "--poses",
        metavar="POSES",
        help=f"poses of the scans: a file in the format of KITTI or TUM, a folder with one "
        f"<sequence>.txt per sequence, {STANDING}, or {ODOMETRY} (default: poses.txt beside the "
        f"scans, otherwise {ODOMETRY})",
    )


def placed(source: Source, poses: str | None, threads: int) -> Source:
    """The same frames with their poses.

    It warns of scans where odometry fails.

    Args:
        source: The frames.
        poses: What ``--poses`` names; None leaves the frames as they are.
        threads: Threads of the odometry; 0 takes all cores.

    Raises:
        InputError: Poses that cannot be read or do not fit the scans.
    """
    if poses is None:
        return source
    if poses != ODOMETRY:
        return with_poses(source, poses)
    notices = Notices()
    with tqdm(total=len(source), desc=ODOMETRY, unit="scan", disable=None) as bar:

        def watch(frame: Frame, registration: Registration) -> None:
            notices.tell(frame.name, registration.oddities())
            bar.update()

        posed = with_poses(source, ODOMETRY, threads, watch)
    notices.tell_how_many_more()
    return posed
