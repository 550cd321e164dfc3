"""Rotations as unit quaternions x, y, z, w."""

import numpy as np
from numpy.typing import NDArray

# Closer than this, in radians, two rotations are the same to every digit, and a line is an arc.
NO_ANGLE = 1e-9


def rotation_of(quaternion: NDArray[np.float64]) -> NDArray[np.float64]:
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


def quaternion_of(rotation: NDArray[np.float64]) -> NDArray[np.float64]:
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
    quaternion: NDArray[np.float64] = np.linalg.eigh(symmetric)[1][:, -1]
    return -quaternion if quaternion[3] < 0 else quaternion


def slerp(
    first: NDArray[np.float64], second: NDArray[np.float64], share: float
) -> NDArray[np.float64]:
    """A rotation on the shortest way from one to another.

    Args:
        first: Unit quaternion x, y, z, w, float64 (4,).
        second: The other one.
        share: How far on the way, 0..1.

    Source: K. Shoemake, "Animating Rotation with Quaternion Curves", SIGGRAPH 1985.
    """
    cosine = float(first @ second)
    if cosine < 0:  # both signs of a quaternion are one rotation; this one is nearer
        second, cosine = -second, -cosine
    angle = float(np.arctan2(np.linalg.norm(second - cosine * first), cosine))
    if angle < NO_ANGLE:
        return first
    weights = np.sin([(1 - share) * angle, share * angle]) / np.sin(angle)
    mixed: NDArray[np.float64] = weights[0] * first + weights[1] * second
    return mixed
