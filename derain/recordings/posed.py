"""Frames with poses: of a file, of a sensor that stands, or found by odometry."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from derain.errors import InputError
from derain.files.reading import reading
from derain.recordings.odometry import FrameOdometry, Registration
from derain.scan import Scan
from derain.sources.frame import Frame
from derain.sources.recordings import recordings_of
from derain.sources.records import line_of
from derain.sources.source import Frames
from derain.sources.trajectory import Trajectory, read_trajectory

# What stands for poses that are in no file.
STANDING, ODOMETRY = "standing", "odometry"

OnRegistration = Callable[[Frame, Registration], None]


def with_poses(
    source: Sequence[Frame],
    poses: str | Path | None = None,
    threads: int = 0,
    on_registration: OnRegistration | None = None,
) -> Frames:
    """The same frames, each with its pose.

    Args:
        source: The frames.
        poses: ``standing``, ``odometry``, a file of poses in KITTI's or TUM's form, or a folder
            with one for each recording, ``<sequence>.txt``. None takes the poses that lie beside
            the scans, and odometry for a recording in which a scan has none.
        threads: Threads that odometry may use; 0 takes every core.
        on_registration: Called with each frame and its registration as soon as that is found.

    Returns:
        The frames. Where odometry cannot be trusted, the frame no longer follows the one before it:
        no window reaches over the gap.

    Raises:
        InputError: A record that is damaged, or does not fit the scans.
    """
    if poses == STANDING:
        return Frames(frame.with_pose(np.eye(4)) for frame in source)
    if poses == ODOMETRY:
        return _with_odometry_poses(source, threads, on_registration)
    if poses is not None:
        return _with_file_poses(source, Path(poses))
    found: list[Frame] = []
    for recording in recordings_of(source):
        known = all(frame.pose is not None for frame in recording)
        found += recording if known else _with_odometry_poses(recording, threads, on_registration)
    return Frames(found)


def _with_odometry_poses(
    source: Sequence[Frame], threads: int, on_registration: OnRegistration | None
) -> Frames:
    """The same frames with poses found from their scans, which are all read once.

    The poses of a recording are in the frame of its first scan. A scan that cannot be read or
    registered is where the sensor would be if it had gone on as it did, and neither follows the
    one before it nor is followed by the one after.
    """
    odometry = FrameOdometry(threads)
    posed: list[Frame] = []
    gaps = 0  # of all recordings: two parts of one must not close up to one another
    for recording in recordings_of(source):
        for frame in recording:
            registration = odometry.register(frame, _scan_of(frame))
            if on_registration is not None:
                on_registration(frame, registration)
            gaps += not registration.trusted
            posed.append(replace(frame.with_pose(registration.pose), number=frame.number + gaps))
    return Frames(posed)


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
        raise InputError(
            path,
            f"is one file of poses for {len(recordings):,} recordings",
            "Name a folder with one for each, <sequence>.txt.",
        )
    posed: list[Frame] = []
    for recording in recordings:
        file = path / f"{recording[0].sequence}.txt" if folder else path
        poses = _poses(recording, read_trajectory(file))
        posed += [frame.with_pose(pose) for frame, pose in zip(recording, poses, strict=True)]
    return Frames(posed)


def _poses(recording: Sequence[Frame], trajectory: Trajectory) -> Iterator[NDArray[np.float64]]:
    """The pose of each frame."""
    names = [Path(frame.name).name for frame in recording]
    if trajectory.times is not None:  # else the scans' own are not read, damaged or not
        times = [time for frame in recording if (time := frame.time) is not None]
        if len(times) == len(recording) and trajectory.is_by_time(times):
            yield from map(trajectory.at, times, names)
            return
    for place, name in enumerate(names):
        record, lines = Path(trajectory.name), len(trajectory)
        yield trajectory.poses[line_of(record, lines, name, place, len(recording))]


def _scan_of(frame: Frame) -> Scan | None:
    """The scan of a frame; None where it cannot be read, an error of whatever needs it later."""
    try:
        return frame.read()
    except InputError:
        return None
