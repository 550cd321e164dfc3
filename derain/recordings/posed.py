"""Frames with poses: from a file, of a sensor at rest, or computed by odometry."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from derain.errors import InputError
from derain.files.reading import reading
from derain.recordings.odometry import FrameOdometry, Registration
from derain.scan import Scan
from derain.sources.frame import Frame
from derain.sources.recordings import recordings_of
from derain.sources.records import poses_along
from derain.sources.source import Frames
from derain.sources.stored_frame import StoredBag
from derain.sources.trajectory import read_trajectory
from derain.sources.unreadable_bag import UnreadableBag
from derain.views.scan_issues import ScanIssue

# What stands for poses that are in no file.
STANDING, ODOMETRY = "standing", "odometry"


@dataclass(frozen=True)
class Odometry:
    """Finds the poses of whole recordings, in the process that judges them.

    Attributes:
        threads: Threads that it may use; 0 takes every core.
    """

    threads: int = 0

    def __call__(self, frames: Sequence[Frame]) -> list[tuple[Frame, list[ScanIssue]]]:
        """Each frame with its pose, as :func:`with_odometry` gives it, and warnings about it."""
        registered = with_odometry(frames, self.threads)
        return [(frame, list(registration.issues())) for frame, registration in registered]


def with_poses(
    source: Sequence[Frame], poses: str | Path | None = None, threads: int = 0
) -> Frames:
    """The same frames, each with its pose.

    Args:
        source: The frames.
        poses: ``standing``, ``odometry``, a file of poses in KITTI's or TUM's form, or a folder
            with one for each recording, ``<sequence>.txt``. None takes the poses that lie beside
            the scans, and odometry for a recording in which a scan has none.
        threads: Threads that odometry may use; 0 takes every core.

    Returns:
        The frames. Where odometry cannot be trusted, the frame no longer follows the one before it:
        no window reaches over the gap.

    Raises:
        InputError: A record that is damaged, or does not fit the scans.
    """
    if poses == STANDING:
        return Frames(frame.with_pose(np.eye(4)) for frame in source)
    if poses == ODOMETRY:
        return Frames(frame for frame, _ in with_odometry(source, threads))
    if poses is not None:
        return _with_file_poses(source, Path(poses))
    found: list[Frame] = []
    for recording in recordings_of(source):
        known = all(frame.pose is not None for frame in recording)
        found += recording if known else with_poses(recording, ODOMETRY, threads)
    return Frames(found)


def with_odometry(
    source: Sequence[Frame], threads: int = 0
) -> Iterator[tuple[Frame, Registration]]:
    """The same frames with poses found from their scans, which are all read once.

    The poses of a recording are in the frame of its first scan. A scan that cannot be read or
    registered is where the sensor would be if it had gone on as it did, and neither follows the
    one before it nor is followed by the one after.

    Args:
        source: The frames.
        threads: Threads that odometry may use; 0 takes every core.

    Yields:
        Each frame with its pose, as soon as that is found, and its registration.
    """
    odometry = FrameOdometry(threads)
    gaps = 0  # of all recordings: two parts of one must not close up to one another
    for recording in recordings_of(source):
        for frame in recording:
            registration = odometry.register(frame, _scan_of(frame))
            gaps += not registration.trusted
            posed = replace(frame.with_pose(registration.pose), number=frame.number + gaps)
            yield posed, registration


def _with_file_poses(source: Sequence[Frame], path: Path) -> Frames:
    """The same frames with the poses of a file, or of the files of a folder.

    Poses with times belong to the scans by these where the scans have times of the same clock, else
    line by line as in :func:`~derain.sources.records.line_of`.

    Raises:
        InputError: A file that is missing, damaged, of another recording or of another length.
    """
    recordings = recordings_of(source)
    with reading(path):
        folder = path.is_dir()
    if len(recordings) > 1 and not folder:
        reason = f"is one file of poses for {len(recordings):,} recordings"
        raise InputError(path, reason, "Name a folder with one for each, <sequence>.txt.")
    posed: list[Frame] = []
    for recording in recordings:
        file = path / f"{recording[0].sequence}.txt" if folder else path
        bag = recording[0]
        if isinstance(bag, UnreadableBag):
            posed.append(bag)
            continue
        trajectory = read_trajectory(file)
        if isinstance(bag, StoredBag):  # whose clouds are known when it is fetched
            posed.append(replace(bag, trajectory=trajectory))
            continue
        poses = poses_along(recording, trajectory)
        posed += [frame.with_pose(pose) for frame, pose in zip(recording, poses, strict=True)]
    return Frames(posed)


def _scan_of(frame: Frame) -> Scan | None:
    """The scan of a frame; None if it cannot be read, which is an error where it is needed."""
    try:
        return frame.read()
    except InputError:
        return None
