"""Poses in KITTI's and TUM's form: read, written, and interpolated."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derain.errors import InputError
from derain.files.extrinsics import motion_of_pose
from derain.sources.trajectory import (
    LONGEST_GAP,
    TIME_ROUNDING,
    Trajectory,
    quaternion_of,
    read_trajectory,
    rotation_of,
    slerp,
    write_trajectory,
)

degrees = st.floats(-180, 180)
motions = st.builds(
    lambda x, y, z, roll, pitch, yaw: motion_of_pose(x, y, z, roll, pitch, yaw),
    *3 * [st.floats(-1e4, 1e4)],
    *3 * [degrees],
)

# Takes x forward, y left, z up to the camera's x right, y down, z forward.
TO_CAMERA = np.array([[0, -1, 0, 0.1], [0, 0, -1, -0.2], [1, 0, 0, -0.3], [0, 0, 0, 1.0]])


def turned(yaw: float) -> np.ndarray:
    return motion_of_pose(0, 0, 0, 0, 0, yaw)[:3, :3]


@given(motions)
def test_a_quaternion_is_its_rotation(motion) -> None:
    quaternion = quaternion_of(motion[:3, :3])
    assert np.linalg.norm(quaternion) == pytest.approx(1)
    assert quaternion[3] >= 0
    np.testing.assert_allclose(rotation_of(quaternion), motion[:3, :3], atol=1e-12)
    np.testing.assert_allclose(rotation_of(-3 * quaternion), motion[:3, :3], atol=1e-12)


@given(degrees, st.floats(-170, 170), st.floats(0, 1))
def test_on_the_way_between_two_turns_lies_their_share(start, change, share) -> None:
    found = slerp(quaternion_of(turned(start)), quaternion_of(turned(start + change)), share)
    np.testing.assert_allclose(rotation_of(found), turned(start + share * change), atol=1e-9)


@given(poses=st.lists(motions, max_size=5), calibrated=st.booleans())
def test_what_is_written_is_read(tmp_path_factory, poses, calibrated) -> None:
    folder = tmp_path_factory.mktemp("poses")
    if calibrated:
        numbers = " ".join(map(str, TO_CAMERA[:3].ravel()))
        (folder / "calib.txt").write_text(f"Tr: {numbers}\n")
    stacked = np.array(poses).reshape(-1, 4, 4)
    for path in (folder / "new" / "poses.txt", folder / "poses.txt"):
        write_trajectory(path, stacked)
        np.testing.assert_allclose(read_trajectory(path).poses, stacked, atol=1e-6)
    lines = (folder / "poses.txt").read_text().splitlines()
    assert {len(line.split()) for line in lines} <= {12}
    if calibrated and poses:  # they are the camera's
        camera = np.array(lines[0].split(), float).reshape(3, 4)
        expected = TO_CAMERA @ poses[0] @ np.linalg.inv(TO_CAMERA)
        np.testing.assert_allclose(camera, expected[:3], atol=1e-6)


def tum(*lines: str) -> str:
    return "# time x y z qx qy qz qw\n" + "".join(f"{line}\n" for line in lines)


def test_a_byte_order_mark_is_read_over(tmp_path) -> None:
    path = tmp_path / "drive.txt"
    path.write_text("1 0 0 2 0 1 0 3 0 0 1 4\n", "utf-8-sig")
    assert read_trajectory(path).poses[0, :3, 3].tolist() == [2, 3, 4]


def test_poses_by_time_are_found_at_their_times_and_between_them(tmp_path) -> None:
    half = np.sqrt(0.5)
    path = tmp_path / "drive.tum"
    path.write_text(tum("10.0 0 0 0 0 0 0 1", "", "10.5 2 4 6 0 0 -1.4142e0 1.4142e0"))
    with pytest.raises(InputError, match="pose 2 has a quaternion of length 2, not 1"):
        read_trajectory(path)
    path.write_text(tum("10.0 0 0 0 0 0 0 1", "", f"10.5 2 4 6 0 0 {-half} {-half}"))
    trajectory = read_trajectory(path)
    np.testing.assert_array_equal(trajectory.at(10, "a"), np.eye(4))
    middle = trajectory.at(10.25, "b")
    np.testing.assert_allclose(middle[:3, 3], (1, 2, 3))
    np.testing.assert_allclose(middle[:3, :3], turned(45), atol=1e-9)
    np.testing.assert_array_equal(
        trajectory.at(10.5 + 0.9 * TIME_ROUNDING, "c"), trajectory.poses[1]
    )
    assert trajectory.is_by_time([10.2])
    assert not trajectory.is_by_time([1.7e9])
    assert not trajectory.is_by_time([])


@pytest.mark.parametrize("time", [9.9, 10 + LONGEST_GAP, 14.1])
def test_times_without_a_pose_are_refused(time) -> None:
    times = np.array([10, 10 + 2 * LONGEST_GAP, 14])
    trajectory = Trajectory(np.tile(np.eye(4), (3, 1, 1)), times, "drive.tum")
    with pytest.raises(InputError, match=r"drive\.tum: has no pose for 7\.bin, which was taken at"):
        trajectory.at(time, "7.bin")
    np.testing.assert_array_equal(trajectory.at(times[1], "8.bin"), np.eye(4))


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("1 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n", "pose 2 is not later than the one before it"),
        ("1 0 0 0 0 0 0 0\n", "quaternion of length 0, not 1"),
        ("1 0 0 0 1e300 0 0 1\n", "quaternion of length inf, not 1"),
        ("1 0 0 0 0 0 0 1\n1 2 3\n", "line 2 is not 8 numbers"),
        ("# 1 2 3\n\n1 2 3\n", "line 3 is not 12 numbers"),
    ],
)
def test_damage_is_named_with_its_line(tmp_path, content, reason) -> None:
    path = tmp_path / "drive.tum"
    path.write_text(content)
    with pytest.raises(InputError, match=reason):
        read_trajectory(path)


def test_nothing_half_written_is_left(tmp_path) -> None:
    path = tmp_path / "poses.txt"
    path.write_text("as it was")
    (tmp_path / "calib.txt").write_text("damaged")
    with pytest.raises(InputError, match="has no line Tr"):
        write_trajectory(path, np.eye(4)[None])
    assert path.read_text() == "as it was"
    assert {file.name for file in tmp_path.iterdir()} == {"poses.txt", "calib.txt"}
