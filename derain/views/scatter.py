"""The scatter of neighbourhoods: along a line, over a surface, or through space."""

import math

import numpy as np

from derain.scan import Floats, Ints

# Below any trace of a covariance that distinct positions can have.
_NOTHING = 1e-300


def scatter_through_space(xyz: Floats, neighbours: Ints) -> Floats:
    """Smallest eigenvalue of each neighbourhood's covariance over the sum of all three.

    Args:
        xyz: Coordinates, float64 (M, 3), metres.
        neighbours: Points of each neighbourhood as rows of ``xyz``, int64 (Q, k).

    Returns:
        From 0, for points in one plane, to 1/3, for points scattered alike in all directions; 0
        for points in one place. float64 (Q,).

    Source: the closed form of O. K. Smith, "Eigenvalues of a symmetric 3 × 3 matrix",
        Communications of the ACM 4, 1961.
    """
    x, y, z = (_about_their_mean(axis[neighbours.T]) for axis in np.ascontiguousarray(xyz.T))
    xx, yy, zz = ((axis * axis).sum(axis=0) for axis in (x, y, z))
    xy, xz, yz = ((one * other).sum(axis=0) for one, other in ((x, y), (x, z), (y, z)))
    trace = np.maximum(xx + yy + zz, _NOTHING)
    # In units of the trace no power of an entry is too small or too large for a number.
    xx, yy, zz, xy, xz, yz = (entry / trace for entry in (xx, yy, zz, xy, xz, yz))
    xx, yy, zz = xx - 1 / 3, yy - 1 / 3, zz - 1 / 3
    spread = np.sqrt((xx * xx + yy * yy + zz * zz + 2 * (xy * xy + xz * xz + yz * yz)) / 6)
    determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
    cosine = determinant / np.maximum(2 * spread**3, _NOTHING)
    angle = np.arccos(np.clip(cosine, -1, 1)) / 3
    smallest = 1 / 3 + 2 * spread * np.cos(angle + 2 * math.pi / 3)
    return np.where(trace > _NOTHING, np.maximum(smallest, 0), 0)


def _about_their_mean(values: Floats) -> Floats:
    """The values of each column less their mean, float64 (k, Q)."""
    return np.asarray(values - values.mean(axis=0))
