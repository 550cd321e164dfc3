"""The mounting of a sensor: the transform of its points into another sensor's frame."""

from pathlib import Path

import numpy as np

from derain.files.documents import Entry
from derain.scan import Float32s, Floats, to_float32

POSE = ("x", "y", "z", "roll", "pitch", "yaw")

# Largest difference of the product of a rotation and its transpose to the identity, element by
# element: the numbers in calibration files are rounded, to four digits or more.
ROTATION_TOLERANCE = 1e-3


def motion_of_pose(x: float, y: float, z: float, roll: float, pitch: float, yaw: float) -> Floats:
    """Takes points of a sensor into the frame in which the sensor has a pose.

    Args:
        x: Position of the sensor: ahead, metres.
        y: To the left, metres.
        z: Above, metres.
        roll: Turn about its x axis, degrees, applied first.
        pitch: About the y axis, degrees; positive looks down.
        yaw: About the z axis, degrees, applied last; positive looks left.

    Returns:
        Homogeneous transformation, float64 (4, 4), translation in metres.

    Source: ROS REP 103, fixed-axis roll, pitch, yaw.
    """
    cr, cp, cy = np.cos(np.radians([roll, pitch, yaw]))
    sr, sp, sy = np.sin(np.radians([roll, pitch, yaw]))
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr, x],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr, y],
            [-sp, cp * sr, cp * cr, z],
            [0, 0, 0, 1],
        ]
    )


def moved(xyz: Float32s, motion: Floats) -> Float32s:
    """Moves points, float32 (N, 3), metres, by a homogeneous transformation, float64 (4, 4)."""
    return to_float32(xyz @ motion[:3, :3].T + motion[:3, 3])


def check_rigid(matrix: Floats) -> None:
    """Refuses what is not a rigid motion from one sensor's frame into another's.

    Args:
        matrix: Homogeneous transformation, float64 (4, 4), translation in metres.

    Raises:
        ValueError: A matrix that is not rigid.
    """
    if not (
        matrix.shape == (4, 4)
        and np.array_equal(matrix[3], (0, 0, 0, 1))
        and np.isfinite(matrix).all()
        and _is_rotation(matrix[:3, :3])
    ):
        raise ValueError("not a rotation and a translation above the row 0 0 0 1")


def read_extrinsics(path: Path) -> Floats:
    """Reads where a sensor is mounted, as the motion of its points into the other frame.

    Args:
        path: A YAML file with the sensor's pose (``x``, ``y``, ``z`` in metres; ``roll``,
            ``pitch``, ``yaw`` in degrees), or with ``matrix``, four rows of four numbers that take
            points of the sensor into the other frame.

    Returns:
        Homogeneous transformation, float64 (4, 4), translation in metres.

    Raises:
        InputError: A file that is missing or has other keys, or a motion that is not rigid.
    """
    document = Entry.of_yaml(path)
    values = document.members()
    if values.keys() == set(POSE):
        return motion_of_pose(**{name: value.number() for name, value in values.items()})
    if values.keys() != {"matrix"}:
        remedy = f"It needs {', '.join(POSE)} (metres, degrees), or matrix (4 rows of 4 numbers)."
        raise document.fault(f"its keys are {', '.join(values)}", remedy)
    matrix = values["matrix"]
    motion = np.array([row.numbers(4) for row in matrix.items()], np.float64)
    try:
        check_rigid(motion)
    except ValueError as error:
        raise matrix.fault(str(error), "Write a rigid motion, or the sensor's pose.") from error
    return motion


def _is_rotation(matrix: Floats) -> bool:
    # Large elements are refused first, before their squares can overflow.
    return bool(
        np.abs(matrix).max() <= 1 + ROTATION_TOLERANCE
        and np.abs(matrix @ matrix.T - np.eye(3)).max() <= ROTATION_TOLERANCE
        and np.linalg.det(matrix) > 0
    )
