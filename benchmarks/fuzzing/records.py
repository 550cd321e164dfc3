"""Records of times and places of scans: times, poses and the calibration beside them."""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np

from benchmarks.fuzzing.reader import Reader
from derain.errors import InputError
from derain.sources.number_lines import read_numbers
from derain.sources.records import POSES, TIMES
from derain.sources.trajectory import CALIBRATION, read_trajectory

POSE = "1 0 0 0.5 0 1 0 -0.25 0 0 1 0\n"
TURNED = "0 -1 0 1.5e+00 1 0 0 2 0 0 1 -3.25\n"
BY_TIME = (
    "# time x y z qx qy qz qw\n"
    "1311868164.36 0.5 -0.25 0 0 0 0 1\n"
    "1311868164.46 1.5 2 -3.25 0 0 0.70710678 0.70710678\n"
)
TO_CAMERA = "P0: 1 2 3\nTr: 0 -1 0 0.1 0 0 -1 0.2 1 0 0 0.3\n"


def readers() -> list[Reader]:
    """One for each kind of record."""
    hostile = [
        lambda: b"1e999 " * 12,
        lambda: b"nan " * 12,
        lambda: b"0 " * 12,
        lambda: b"1e300 " * 12,
        lambda: b"\xff\xfe1\x00",
        lambda: b"1\n" * 300_000,
        lambda: b"9" * 5000,
    ]
    poses = (POSE + TURNED).encode()
    return [
        Reader("poses", POSES, _read_poses, lambda: [poses], hostile),
        Reader("tum", POSES, _read_poses, lambda: [BY_TIME.encode()], [*hostile, *_hostile_tum()]),
        Reader("calib", CALIBRATION, _read_calibration, lambda: [TO_CAMERA.encode()], hostile),
        Reader("seconds", TIMES, _read_seconds, lambda: [b"0.0\n1.036e-01\n2\n"], hostile),
    ]


def _hostile_tum() -> list[Callable[[], bytes]]:
    return [
        lambda: b"1 0 0 0 0 0 0 0\n",
        lambda: b"1 0 0 0 1e300 1e300 1e300 1e300\n",
        lambda: b"1 0 0 0 0 0 0 1\n" * 2,
        lambda: b"-1e308 0 0 0 0 0 0 1\n1e308 1e308 0 0 0 0 0 1\n",
        lambda: b"#\n" * 300_000,
        lambda: POSE.encode() + BY_TIME.encode(),
    ]


def _read_poses(path: Path) -> None:
    trajectory = read_trajectory(path)
    poses = trajectory.poses
    assert poses.shape[1:] == (4, 4)
    turned = poses[:, :3, :3] @ poses[:, :3, :3].transpose(0, 2, 1)
    assert np.abs(turned - np.eye(3)).max(initial=0) < 0.01
    assert np.isfinite(poses).all()
    if trajectory.times is not None and trajectory.is_by_time(trajectory.times):
        assert (np.diff(trajectory.times) > 0).all()
        middle = trajectory.times[0] / 2 + trajectory.times[-1] / 2
        with suppress(InputError):  # of poses that are far apart
            assert np.isfinite(trajectory.at(middle, "scan")).all()


def _read_calibration(path: Path) -> None:
    path.with_name(POSES).write_text(POSE + TURNED)
    _read_poses(path.with_name(POSES))


def _read_seconds(path: Path) -> None:
    seconds = read_numbers(path, 1)
    assert seconds.shape[1:] == (1,)
    assert np.isfinite(seconds).all()
