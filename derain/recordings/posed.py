"""Frames with poses: from a file, of a sensor at rest, or computed by odometry."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from derain.errors import InputError
from derain.files.reading import reading
from derain.recordings.odometry import FrameOdometry
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


def with_poses(source: Sequence[Frame], poses: str | Path) -> Frames:
    """The same frames, each with its pose.

    Poses with times belong to the scans by these where the scans have times of the same clock, else
    line by line as in :func:`~derain.sources.records.line_of`.

    Args:
        source: The frames.
        poses: ``standing``, a file of poses in KITTI's or TUM's form, or a folder with one for each
            recording, ``<sequence>.txt``.

    Raises:
        InputError: A file that is missing, damaged, of another recording or of another length.
    """
    if poses == STANDING:
        return Frames(frame.with_pose(np.eye(4)) for frame in source)
    path, recordings = Path(poses), recordings_of(source)
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
        along = poses_along(recording, trajectory)
        posed += [frame.with_pose(pose) for frame, pose in zip(recording, along, strict=True)]
    return Frames(posed)


def with_odometry(
    source: Sequence[Frame], threads: int = 0
) -> Iterator[tuple[Frame, list[ScanIssue]]]:
    """The same frames with poses found from their scans, which are all read once.

    The poses of a recording are in the frame of its first scan. A scan that cannot be read or
    registered is where the sensor would be if it had gone on as it did, and neither follows the
    one before it nor is followed by the one after.

    Args:
        source: The frames.
        threads: Threads that odometry may use; 0 takes every core.

    Yields:
        Each frame with its pose, as soon as that is found, and warnings about it.
    """
    odometry = FrameOdometry(threads)
    gaps = 0  # of all recordings: two parts of one must not close up to one another
    for recording in recordings_of(source):
        for frame in recording:
            registration = odometry.register(frame, _scan_of(frame))
            gaps += not registration.trusted
            posed = replace(frame.with_pose(registration.pose), number=frame.number + gaps)
            yield posed, list(registration.issues())


def _scan_of(frame: Frame) -> Scan | None:
    """The scan of a frame; None if it cannot be read, which is an error where it is needed."""
    try:
        return frame.read()
    except InputError:
        return None
