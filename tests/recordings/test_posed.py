"""Frames get their poses from a file, or stand."""

from dataclasses import replace

import numpy as np
import pytest

from derain.errors import InputError
from derain.files import write_scan
from derain.recordings.odometry import FrameOdometry
from derain.recordings.posed import with_poses
from derain.scan import Scan
from derain.sources.folders import named_frames
from derain.sources.frame import MemoryFrame
from derain.sources.source import Frames

from .street import motion, scan_from

STEP = motion(1.3, yaw=0.5)


@pytest.fixture(scope="module")
def scans() -> list[Scan]:
    """Four scans of a drive, one step apart."""
    poses = [np.linalg.matrix_power(STEP, number) for number in range(4)]
    return [scan_from(pose, seed) for seed, pose in enumerate(poses)]


@pytest.fixture
def drive(scans) -> Frames:
    return Frames.of_scans(scans, "drive")


def x_of(frames: Frames) -> list[float]:
    return [round(float(frame.pose[0, 3]), 9) for frame in frames]


def lines(ahead: list[float]) -> str:
    return "".join(f"1 0 0 {x} 0 1 0 0 0 0 1 0\n" for x in ahead)


def test_a_sensor_at_rest_is_at_the_identity() -> None:
    drive = Frames.of_scans([Scan(np.ones((1, 3)))] * 2)
    assert all((frame.pose == np.eye(4)).all() for frame in with_poses(drive, "standing"))


def test_a_scan_taken_before_the_one_that_it_follows_is_not_trusted(drive) -> None:
    odometry = FrameOdometry()
    times = (0.0, 0.1, 0.1, 0.05)
    found = [
        odometry.register(replace(frame, time=time), frame.read())
        for frame, time in zip(drive, times, strict=True)
    ]
    assert [each.trusted for each in found] == [True, True, False, False]
    assert "at 0.100 s, the scan before at 0.100 s" in found[2].reason


def test_poses_of_a_file_go_line_by_line_or_by_number(drive, tmp_path) -> None:
    path = tmp_path / "mine.txt"
    path.write_text(lines([0, 1, 2, 3]))
    assert x_of(with_poses(drive, path)) == [0, 1, 2, 3]
    assert x_of(with_poses(drive, str(path))) == [0, 1, 2, 3]
    for number, frame in enumerate(drive):
        write_scan(tmp_path / f"drive/{number + 5:06d}.pcd", frame.read())
    some = named_frames([tmp_path / "drive"])
    path.write_text(lines(list(range(9))))
    assert x_of(with_poses(some, path)) == [5, 6, 7, 8]


def test_poses_of_a_file_go_by_time_where_both_have_one(drive, tmp_path) -> None:
    path = tmp_path / "mine.tum"
    path.write_text("0.95 0 0 0 0 0 0 1\n1.45 5 0 0 0 0 0 1\n")
    timed = [replace(frame, time=1 + frame.number / 10) for frame in drive]
    assert x_of(with_poses(timed, path)) == [0.5, 1.5, 2.5, 3.5]
    path.write_text("".join(f"{n} {n} 0 0 0 0 0 1\n" for n in range(4)))
    assert x_of(with_poses(drive, path)) == [0, 1, 2, 3]


def test_a_folder_has_a_file_for_each_recording(drive, tmp_path) -> None:
    both = [*drive, *Frames.of_scans([drive[0].read()], "other")]
    with pytest.raises(InputError, match=r"drive\.txt: there is no such file"):
        with_poses(both, tmp_path)
    (tmp_path / "drive.txt").write_text(lines([0, 1, 2, 3]))
    (tmp_path / "other.txt").write_text(lines([7]))
    assert x_of(with_poses(both, tmp_path)) == [0, 1, 2, 3, 7]
    with pytest.raises(InputError, match="is one file of poses for 2 recordings"):
        with_poses(both, tmp_path / "drive.txt")


@pytest.mark.parametrize("count", [0, 3, 5])
def test_poses_of_another_length_are_refused(scans, tmp_path, count) -> None:
    named = Frames(
        MemoryFrame(key=f"{n}", number=n, scan=replace(scan, name=f"scan_{n}"))
        for n, scan in enumerate(scans)
    )
    path = tmp_path / "mine.txt"
    path.write_text(lines(list(range(count))))
    with pytest.raises(InputError, match=f"has {count} lines for 4 scans, and none for scan_0"):
        with_poses(named, path)


def test_poses_that_go_by_lines_ask_for_no_times(drive, tmp_path) -> None:
    for number, frame in enumerate(drive[:2]):
        write_scan(tmp_path / f"a/{number}.pcd", frame.read())
    (tmp_path / "a/times.txt").write_text("soon")
    (tmp_path / "mine.txt").write_text(lines([4, 5]))
    frames = named_frames([tmp_path / "a"])
    assert x_of(with_poses(frames, tmp_path / "mine.txt")) == [4, 5]
