"""Frames with poses: from a file, or of a sensor at rest."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from derain.errors import InputError
from derain.files.reading import reading
from derain.sources.bag_frame import UnreadableBag
from derain.sources.frame import Frame
from derain.sources.recordings import recordings_of
from derain.sources.records import poses_along
from derain.sources.source import Frames, Source
from derain.sources.stored_frame import StoredBag
from derain.sources.trajectory import read_trajectory

# What stands for the poses of a sensor at rest.
STANDING = "standing"


def with_poses(source: Source, poses: str | Path | None) -> Source:
    """The same frames, each with its pose.

    Poses with times belong to the scans by these where the scans have times of the same clock, else
    line by line as in :func:`~derain.sources.records.line_of`.

    Args:
        source: The frames.
        poses: ``standing``, a file of poses in KITTI's or TUM's form, or a folder with one for each
            recording, ``<sequence>.txt``. None leaves the frames as they are: a method that needs
            poses takes those beside the scans, or finds them by odometry.

    Raises:
        InputError: A file that is missing, damaged, of another recording or of another length.
    """
    if poses is None:
        return source
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
