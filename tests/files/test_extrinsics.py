"""Where a sensor is: against SciPy's rotations, and what no sensor's place can be."""

import re

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from derain.errors import InputError
from derain.files.extrinsics import POSE, motion_of_pose, moved, read_extrinsics

degrees = st.floats(-360, 360)
metres = st.floats(-10, 10)
poses = st.tuples(metres, metres, metres, degrees, degrees, degrees)
POINTS = np.random.default_rng(0).uniform(-100, 100, (20, 3)).astype(np.float32)


@given(poses)
def test_a_pose_turns_about_fixed_axes_and_then_moves(pose) -> None:
    rotation = Rotation.from_euler("xyz", pose[3:], degrees=True)  # lower case: fixed axes
    expected = rotation.apply(POINTS.astype(np.float64)) + pose[:3]
    points = moved(POINTS, motion_of_pose(*pose))
    assert points.dtype == np.float32
    np.testing.assert_allclose(points, expected, atol=1e-5)


def test_a_file_holds_a_pose_or_a_matrix(tmp_path) -> None:
    pose = dict(zip(POSE, (0.5, -0.2, -0.7, 1, -2, 30), strict=True))
    (tmp_path / "pose.yaml").write_text(yaml.safe_dump(pose))
    read = read_extrinsics(tmp_path / "pose.yaml")
    np.testing.assert_array_equal(read, motion_of_pose(**pose))
    # As calibrations are often published: rounded.
    (tmp_path / "matrix.yaml").write_text(yaml.safe_dump({"matrix": read.round(4).tolist()}))
    rounded = read_extrinsics(tmp_path / "matrix.yaml")
    np.testing.assert_allclose(rounded, read, atol=5e-5)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("", "it is empty"),
        ("{x: 0, y: 0, z: 0, roll: 0, pitch: 0, yaws: 0}", "pitch, yaws"),
        ("{x: 0, y: 0, z: 0, roll: 0, pitch: 0, yaw: left}", "yaw: 'left' is not a finite number"),
        ("matrix: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]", "matrix[0]: [1, 0, 0] are not 4 numbers"),
        *(
            (yaml.safe_dump({"matrix": matrix}), "matrix: not a rotation and a translation")
            for matrix in (
                [[1, 0, 0, 0]],
                *(np.diag([value, 1, 1, 1]).tolist() for value in (-1.0, 0.0, 1.01)),
                [[1, 0.1, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]],
                # Products of these are infinite, and their sum is not a number.
                [[1e200, 1e200, 0, 0], [1e200, -1e200, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]],
                [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [2, 0, 0, 1]],
            )
        ),
        (yaml.safe_dump({"matrix": np.eye(4).tolist(), "x": 1}), "its keys are matrix, x"),
    ],
)
def test_what_is_no_rigid_motion_is_refused_in_one_line(tmp_path, content, reason) -> None:
    path = tmp_path / "radar.yaml"
    path.write_text(content)
    with pytest.raises(InputError, match=rf"radar\.yaml: .*{re.escape(reason)}") as refusal:
        read_extrinsics(path)
    assert "\n" not in str(refusal.value)
