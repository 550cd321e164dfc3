"""Frames get their poses from a file or from odometry, or stand."""

from collections.abc import Iterable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from derain.errors import InputError
from derain.files import write_scan
from derain.recordings.odometry import FrameOdometry, shift_of
from derain.recordings.posed import with_odometry, with_poses
from derain.scan import Scan
from derain.sources.file_frame import FileFrame
from derain.sources.folders import named_frames
from derain.sources.frame import Frame, MemoryFrame
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


def by_odometry(source: Iterable[Frame]) -> list[Frame]:
    return [frame for frame, _ in with_odometry(list(source))]


def test_odometry_gives_poses(drive) -> None:
    posed = by_odometry(drive)
    assert [frame.key for frame in posed] == [frame.key for frame in drive]
    for number, frame in enumerate(posed):
        error = np.linalg.inv(np.linalg.matrix_power(STEP, number)) @ frame.pose
        assert shift_of(error) < 0.05
    assert all(later.follows(earlier) for earlier, later in pairwise(posed))


def test_each_recording_starts_at_the_identity(drive) -> None:
    assert all((frame.pose == np.eye(4)).all() for frame in with_poses(drive, "standing"))
    twice = [*drive, *(replace(frame, sequence="again") for frame in drive)]
    posed = by_odometry(twice)
    for number in range(4):
        np.testing.assert_array_equal(posed[number].pose, posed[number + 4].pose)


@pytest.mark.parametrize("unread", [True, False])
def test_no_window_reaches_over_a_scan_that_cannot_be_registered(drive, unread) -> None:
    bad = replace(drive[1], scan=Scan.of(np.zeros((0, 3))))
    if unread:
        bad = FileFrame(key="1", sequence="drive", number=1, path=Path("absent.bin"))
    registered = list(with_odometry([drive[0], bad, *drive[2:]]))
    posed = [frame for frame, _ in registered]
    following = [later.follows(earlier) for earlier, later in pairwise(posed)]
    assert following == [False, False, True]
    assert posed[3].pose[0, 3] == pytest.approx(1.3, abs=0.1)
    reason = "cannot be read" if unread else "only 0 surfaces in reach"
    assert reason in registered[1][1][0].detail


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


def test_gaps_of_one_part_do_not_close_up_to_the_next(drive) -> None:
    blind = [replace(frame, scan=Scan.of(np.zeros((0, 3)))) for frame in drive[:3]]
    later = replace(drive[3], number=5)  # two scans of the sequence are missing before it
    posed = by_odometry([*blind, later])
    assert not any(after.follows(before) for before, after in pairwise(posed))


def test_poses_that_go_by_lines_ask_for_no_times(drive, tmp_path) -> None:
    for number, frame in enumerate(drive[:2]):
        write_scan(tmp_path / f"a/{number}.pcd", frame.read())
    (tmp_path / "a/times.txt").write_text("soon")
    (tmp_path / "mine.txt").write_text(lines([4, 5]))
    frames = named_frames([tmp_path / "a"])
    assert x_of(with_poses(frames, tmp_path / "mine.txt")) == [4, 5]
    assert by_odometry(frames)[1].pose[0, 3] == pytest.approx(1.3, abs=0.05)
