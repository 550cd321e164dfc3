"""Where the sensor was, as a user says it: it stood, or a file has its poses."""

from pathlib import Path

import numpy as np

from derain.errors import InputError
from derain.sources.file_frame import FileFrame
from derain.sources.records import Records
from derain.sources.source import Frames, Source


def standing(source: Source) -> Frames:
    """The same frames, of a sensor that does not move: its own frame is the world's."""
    return source.map(lambda frame: frame.at(np.eye(4)))


def along(source: Source, poses: Path) -> Frames:
    """The same frames, placed by a file of poses.

    Args:
        source: Scans in the files of one folder.
        poses: A file as :class:`~derain.sources.records.Records` reads it, with a pose for each
            scan of the folder, or for each number that the scans may be named by.

    Returns:
        The frames, each with its pose.

    Raises:
        InputError: A file that cannot be read or does not fit the scans; scans of several folders,
            or of none.
    """
    files = [frame for frame in source if isinstance(frame, FileFrame)]
    folders = {frame.path.parent for frame in files}
    if len(files) < len(source) or len(folders) != 1:
        raise InputError(
            poses,
            f"holds the poses of one recording, and the scans lie in {len(folders)} folders",
            "Take one recording at a time, or put a poses.txt beside the scans of each.",
        )
    records = Records(folders.pop(), poses)
    placed = []
    for frame in files:
        pose = records.pose_of(frame.path)
        assert pose is not None  # there is a record, which was named
        placed.append(frame.at(pose))
    return Frames(placed)
