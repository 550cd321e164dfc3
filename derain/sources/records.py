"""When and where the scans of a folder were taken: the records that lie beside them.

- ``times.txt``: a line a scan, seconds. Or ``metadata.csv``, see :mod:`derain.files.frame_times`.
- ``poses.txt``: a line a scan, the upper three rows of a pose, row by row. With a ``calib.txt``
  beside it they are poses of the camera that it names ``Tr`` for, as KITTI's are; without one,
  those of the sensor itself.

Source: A. Geiger et al., "Are we ready for Autonomous Driving? The KITTI Vision Benchmark Suite",
CVPR 2012, readme of the odometry benchmark; J. Behley et al., SemanticKITTI, for Tr.
"""

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from derain.errors import InputError
from derain.files import find_scans
from derain.files.frame_times import METADATA, read_frame_times
from derain.files.names import scan_stem
from derain.files.reading import is_file, read_bytes, reading
from derain.fusion.extrinsics import Extrinsics

TIMES, POSES, CALIBRATION = "times.txt", "poses.txt", "calib.txt"

# Name of the motion in a calibration that takes points of the LiDAR to the camera.
LIDAR_TO_CAMERA = "Tr"

# A pose takes 160 bytes: those of four hundred thousand scans.
LARGEST_RECORD = 2**26


class Records:
    """Times and poses of the scans in one folder, read when the first is asked for.

    Most methods ask for neither, and then nothing is read, damaged or not.

    Args:
        folder: The folder of scans. Its records lie in it, or in the folder that it lies in.
        poses: The record of poses, where it lies elsewhere.
    """

    def __init__(self, folder: Path, poses: Path | None = None) -> None:
        self.folder = folder
        self.poses = poses

    def time_of(self, scan: Path) -> float | None:
        """When a scan of the folder was taken, seconds; None where nothing says so.

        Raises:
            InputError: A record that is damaged or does not fit the scans.
        """
        return None if self._times is None else float(self._times[self._row(scan, TIMES)])

    def pose_of(self, scan: Path) -> NDArray[np.float64] | None:
        """Sensor to world of a scan of the folder, float64 (4, 4), metres; None if not known.

        Raises:
            InputError: A record that is damaged or does not fit the scans.
        """
        return None if self._poses is None else self._poses[self._row(scan, POSES)]

    @cached_property
    def _times(self) -> NDArray[np.float64] | None:
        """Seconds of each scan or line, float64 (T,)."""
        if path := self._beside(TIMES):
            return read_numbers(path, 1)[:, 0]
        if is_file(self.folder / METADATA):
            return read_frame_times(self._scans)
        return None

    @cached_property
    def _poses(self) -> NDArray[np.float64] | None:
        """Sensor to world of each line, float64 (T, 4, 4)."""
        path = self._beside(POSES)
        return None if path is None else read_poses(path)

    @cached_property
    def _scans(self) -> list[Path]:
        return find_scans([self.folder])

    @cached_property
    def _places(self) -> dict[str, int]:
        return {scan.name: place for place, scan in enumerate(self._scans)}

    def _row(self, scan: Path, record: str) -> int:
        """The line of a record that belongs to a scan.

        A record with a line for each scan of the folder goes by their order. One with other lines
        goes by the numbers that the scans are named by, as where only some scans of a sequence
        were copied.
        """
        rows = self._times if record == TIMES else self._poses
        assert rows is not None
        if len(rows) == len(self._scans) and scan.name in self._places:
            return self._places[scan.name]
        stem = scan_stem(scan)
        # Only ASCII: other scripts have digits too, and int() reads them.
        if not (stem.isascii() and stem.isdigit() and int(stem) < len(rows)):
            raise InputError(
                self._beside(record) or self.folder / METADATA,
                f"has {len(rows):,} lines for {len(self._scans):,} scans, and none for {scan.name}",
                "Write a line for each scan of the folder, or for each number up to the last.",
            )
        return int(stem)

    def _beside(self, name: str) -> Path | None:
        """A record in the folder of scans or in that above it; poses, where they are said to be."""
        if name == POSES and self.poses is not None:
            return self.poses
        folder = self.folder.absolute()
        places = (folder / name, folder.parent / name)
        return next((place for place in places if is_file(place)), None)


def read_poses(path: Path) -> NDArray[np.float64]:
    """Reads poses of a LiDAR: of its own, or of a camera with a ``calib.txt`` beside them.

    Args:
        path: A line a scan: twelve numbers, the upper three rows of a pose, metres.

    Returns:
        Sensor to world, float64 (T, 4, 4). Of a camera's poses, the world is the LiDAR's frame
        where the camera's has its origin.

    Raises:
        InputError: A file that cannot be read, or a line that is no rigid motion.
    """
    poses = _motions(path, read_numbers(path, 12))
    calibration = path.with_name(CALIBRATION)
    if not is_file(calibration):
        return poses
    to_camera = _lidar_to_camera(calibration)
    moved: NDArray[np.float64] = np.linalg.inv(to_camera) @ poses @ to_camera
    return moved


def read_numbers(path: Path, columns: int) -> NDArray[np.float64]:
    """Reads lines of so many finite numbers each, float64 (T, columns).

    Raises:
        InputError: A file that cannot be read, is too large, or has another line.
    """
    with reading(path, ValueError):
        text = read_bytes(path, LARGEST_RECORD).decode("utf-8")
    lines = enumerate(text.splitlines(), 1)
    rows = [_numbers(path, place, line.split(), columns) for place, line in lines if line.strip()]
    return np.array(rows, np.float64).reshape(-1, columns)


def _numbers(path: Path, place: int, words: Sequence[str], columns: int) -> list[float]:
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = []
    if len(numbers) != columns or not np.isfinite(numbers).all():
        raise InputError(
            path,
            f"line {place} is not {columns} number{'s' if columns > 1 else ''}",
            "Write the file again, a line for each scan.",
        )
    return numbers


def _motions(path: Path, rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Homogeneous transformations, float64 (T, 4, 4), of their upper three rows, (T, 12)."""
    motions = np.zeros((len(rows), 4, 4))
    motions[:, :3] = rows.reshape(-1, 3, 4)
    motions[:, 3, 3] = 1
    for place, motion in enumerate(motions, 1):
        try:
            Extrinsics(motion)
        except ValueError as error:
            raise InputError(
                path, f"pose {place} is not rigid ({error})", "Write the file again."
            ) from error
    return motions


def _lidar_to_camera(path: Path) -> NDArray[np.float64]:
    """The motion that a calibration names Tr, float64 (4, 4)."""
    with reading(path, ValueError):
        lines = read_bytes(path, LARGEST_RECORD).decode("utf-8").splitlines()
    for line in lines:
        name, _, numbers = line.partition(":")
        if name.strip() == LIDAR_TO_CAMERA:
            row = _numbers(path, lines.index(line) + 1, numbers.split(), 12)
            motion: NDArray[np.float64] = _motions(path, np.array([row]))[0]
            return motion
    raise InputError(
        path,
        f"has no line {LIDAR_TO_CAMERA}, which takes the LiDAR's points to the camera",
        f"Add it, or move the file away if the poses in {POSES} are the LiDAR's own.",
    )
