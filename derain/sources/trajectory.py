"""Poses of a sensor, in files of two formats.

- KITTI's: twelve numbers a line, the upper three rows of a pose, row by row. With a ``calib.txt``
  beside it they are poses of the camera that it names ``Tr`` for; without one, the sensor's own.
- TUM's: ``time x y z qx qy qz qw`` a line, seconds and metres, the sensor's own; lines that begin
  with # are remarks.

Sources: A. Geiger et al., "Are we ready for Autonomous Driving? The KITTI Vision Benchmark Suite",
CVPR 2012, readme of the odometry benchmark; J. Behley et al., SemanticKITTI, for Tr; J. Sturm et
al., "A Benchmark for the Evaluation of RGB-D SLAM Systems", IROS 2012, for TUM's.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import numpy as np

from derain.errors import InputError
from derain.files.atomic import write_text
from derain.files.extrinsics import ROTATION_TOLERANCE, check_rigid
from derain.files.reading import is_file
from derain.scan import Floats
from derain.sources.number_lines import finite_numbers, read_lines, read_numbers

CALIBRATION = "calib.txt"

# Name of the motion in a calibration that takes points of the LiDAR to the camera.
LIDAR_TO_CAMERA = "Tr"

# Numbers in a line of either form.
KITTI, TUM = 12, 8

# Between two poses up to a second apart a vehicle goes smoothly. A scan may lie so much before the
# first or after the last of them, for times are rounded: to hundredths, if carelessly.
LONGEST_GAP = 1.0
TIME_ROUNDING = 0.005


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Poses of a sensor, one after the other.

    Attributes:
        poses: Sensor to world, float64 (T, 4, 4), metres.
        times: Times of the poses, seconds, ascending, float64 (T,); None if unknown.
        name: Its name in messages, such as its file.
    """

    poses: Floats
    times: Floats | None = None
    name: str | Path = "poses"

    def __len__(self) -> int:
        return len(self.poses)

    def fingerprint(self) -> str:
        """A fingerprint of poses and times, hexadecimal digits."""
        times = b"" if self.times is None else self.times.tobytes()
        return sha256(self.poses.tobytes() + times).hexdigest()

    def is_by_time(self, times: Sequence[float] | Floats) -> bool:
        """True if scans find their poses by time: both have times, of one clock it seems.

        Args:
            times: Times of the scans, seconds, (N,).
        """
        if self.times is None or not len(self.times) or not len(times):
            return False
        first, last = self.times[0] - LONGEST_GAP, self.times[-1] + LONGEST_GAP
        return bool(first <= np.max(times) and np.min(times) <= last)

    def at(self, time: float, scan: str) -> Floats:
        """The pose at a time; between two poses, on the way from one to the other.

        Args:
            time: Seconds.
            scan: Name of the scan of that time, for messages.

        Returns:
            Sensor to world, float64 (4, 4), metres.

        Raises:
            InputError: There is no pose near enough.
        """
        assert self.times is not None
        inside = min(max(time, self.times[0]), self.times[-1])
        after = int(np.searchsorted(self.times, inside))
        before = after if self.times[after] == inside else after - 1
        start, end = self.times[before], self.times[after]
        if abs(inside - time) > TIME_ROUNDING or end - start > LONGEST_GAP:
            raise InputError(
                self.name,
                f"has no pose for {scan}, which was taken at {time:.3f} s: the nearest are of "
                f"{start:.3f} and {end:.3f} s",
                "Give the poses of the whole recording, by the clock of its scans.",
            )
        one: Floats = self.poses[before]
        if before == after:
            return one
        other: Floats = self.poses[after]
        share = float((inside - start) / (end - start))
        pose = np.eye(4)
        pose[:3, 3] = (1 - share) * one[:3, 3] + share * other[:3, 3]
        turned = slerp(quaternion_of(one[:3, :3]), quaternion_of(other[:3, :3]), share)
        pose[:3, :3] = rotation_of(turned)
        return pose


def read_trajectory(path: Path) -> Trajectory:
    """Reads poses of a LiDAR, in the form that the first line has.

    Args:
        path: A file in KITTI's form, or in TUM's.

    Returns:
        The sensor's poses. Of a camera's, the world is the LiDAR's frame where the camera's has its
        origin.

    Raises:
        InputError: A file that cannot be read, a line that is no rigid motion, or times that do not
            ascend.
    """
    rows = read_numbers(path, TUM, KITTI)
    if rows.shape[1] == TUM:
        return _trajectory_of_tum(path, rows)
    poses = _motions(path, rows)
    calibration = path.with_name(CALIBRATION)
    if is_file(calibration):
        to_camera = _lidar_to_camera(calibration)
        poses = np.linalg.inv(to_camera) @ poses @ to_camera
    return Trajectory(poses, name=path)


def write_trajectory(path: Path, poses: Floats) -> None:
    """Writes poses in KITTI's form, whole or not at all, as :func:`read_trajectory` reads them.

    Args:
        path: The file. Beside a ``calib.txt``, the poses are written as the camera's.
        poses: Sensor to world, float64 (T, 4, 4), metres.

    Raises:
        InputError: It cannot be written, or the ``calib.txt`` beside it cannot be read.
    """
    calibration = path.with_name(CALIBRATION)
    if is_file(calibration):
        to_camera = _lidar_to_camera(calibration)
        poses = to_camera @ poses @ np.linalg.inv(to_camera)
    lines = [" ".join(f"{number:.12g}" for number in pose[:3].ravel()) for pose in poses]
    write_text(path, "".join(f"{line}\n" for line in lines))


def _trajectory_of_tum(path: Path, rows: Floats) -> Trajectory:
    times, quaternions = rows[:, 0], rows[:, 4:]
    if not (np.diff(times) > 0).all():
        place = int(np.argmin(np.diff(times) > 0)) + 2
        raise InputError(
            path,
            f"pose {place} is not later than the one before it",
            "Sort the lines by their time, and leave one for each.",
        )
    with np.errstate(over="ignore"):
        lengths = np.linalg.norm(quaternions, axis=1)
    odd = np.flatnonzero(np.abs(lengths - 1) > ROTATION_TOLERANCE)
    if len(odd):
        raise InputError(
            path,
            f"pose {odd[0] + 1} has a quaternion of length {lengths[odd[0]]:.3g}, not 1",
            "Write the file again: time x y z qx qy qz qw.",
        )
    poses = np.tile(np.eye(4), (len(rows), 1, 1))
    poses[:, :3, 3] = rows[:, 1:4]
    for pose, quaternion in zip(poses, quaternions, strict=True):
        pose[:3, :3] = rotation_of(quaternion)
    return Trajectory(poses, times, path)


def _motions(path: Path, rows: Floats) -> Floats:
    """Homogeneous transformations, float64 (T, 4, 4), of their upper three rows, (T, 12)."""
    motions = np.zeros((len(rows), 4, 4))
    motions[:, :3] = rows.reshape(-1, 3, 4)
    motions[:, 3, 3] = 1
    for place, motion in enumerate(motions, 1):
        try:
            check_rigid(motion)
        except ValueError as error:
            raise InputError(
                path, f"pose {place} is not rigid ({error})", "Write the file again."
            ) from error
    return motions


def _lidar_to_camera(path: Path) -> Floats:
    """The motion that a calibration names Tr, float64 (4, 4)."""
    for place, line in enumerate(read_lines(path), 1):
        name, _, numbers = line.partition(":")
        if name.strip() == LIDAR_TO_CAMERA:
            row = finite_numbers(path, place, numbers.split(), KITTI)
            motion: Floats = _motions(path, np.array([row]))[0]
            return motion
    raise InputError(
        path,
        f"has no line {LIDAR_TO_CAMERA}, which takes the LiDAR's points to the camera",
        "Add it, or move the file away if the poses beside it are the LiDAR's own.",
    )


def rotation_of(quaternion: Floats) -> Floats:
    """The rotation of a unit quaternion.

    Args:
        quaternion: x, y, z, w, float64 (4,).

    Returns:
        float64 (3, 3).

    Source: J. Diebel, "Representing Attitude", Stanford 2006, eq. 125.
    """
    x, y, z, w = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def quaternion_of(rotation: Floats) -> Floats:
    """The unit quaternion of a rotation, x, y, z, w with w of 0 or more, float64 (4,).

    Args:
        rotation: float64 (3, 3).

    Source: I. Y. Bar-Itzhack, "New Method for Extracting the Quaternion from a Rotation Matrix",
    Journal of Guidance, Control, and Dynamics, 2000: it is exact wherever others divide by 0.
    """
    r = rotation
    symmetric = np.empty((4, 4))
    symmetric[:3, :3] = r + r.T - np.trace(r) * np.eye(3)
    symmetric[3, :3] = symmetric[:3, 3] = r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]
    symmetric[3, 3] = np.trace(r)
    quaternion: Floats = np.linalg.eigh(symmetric)[1][:, -1]
    return -quaternion if quaternion[3] < 0 else quaternion


def slerp(first: Floats, second: Floats, share: float) -> Floats:
    """A rotation on the shortest way from one to another.

    Args:
        first: Unit quaternion x, y, z, w, float64 (4,).
        second: The other one.
        share: Share of the way, 0..1.

    Source: K. Shoemake, "Animating Rotation with Quaternion Curves", SIGGRAPH 1985.
    """
    cosine = float(first @ second)
    if cosine < 0:  # both signs of a quaternion are one rotation; this one is nearer
        second, cosine = -second, -cosine
    angle = float(np.arctan2(np.linalg.norm(second - cosine * first), cosine))
    if not angle:
        return first
    weights = np.sin([(1 - share) * angle, share * angle]) / np.sin(angle)
    mixed: Floats = weights[0] * first + weights[1] * second
    return mixed
