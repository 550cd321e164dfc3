"""How far apart the beams of a scan are, and how crowded its points are in steps of them."""

import numpy as np
from numpy.typing import NDArray

# The step of a scan is the median over so many of its points, evenly along their curve.
SAMPLED = 8192

# A step is the angle within which a point's nearest neighbours lie, so many of them: two on either
# side along the axis of finer resolution, and one across it.
STEP_NEIGHBOURS = 3

# The least step, radians, and the step of a scan of too few points.
FINEST_STEP, USUAL_STEP = 1e-4, 0.1

# Nothing is measured nearer than this, metres; it keeps every division finite.
NEAREST_POINT = 0.05

# Points before and after one along the curve that may crowd it, and the distance at which one
# counts half, steps.
WINDOW, HALF_AT = 8, 2.0


def beam_step(
    xyz: NDArray[np.float32], rows: NDArray[np.int64], neighbours: NDArray[np.int64]
) -> float:
    """The angle between neighbouring beams, by what lies near some points.

    Args:
        xyz: Positions in the sensor's frame, float32 (M, 3), metres.
        rows: Some of the points, int64 (Q,).
        neighbours: Each of these and its nearest neighbours, rows of ``xyz``, int64
            (Q, 1 + STEP_NEIGHBOURS).

    Returns:
        Radians.
    """
    if len(xyz) <= STEP_NEIGHBOURS:
        return USUAL_STEP
    own = _directions(xyz.take(rows, axis=0))
    chords = np.zeros(len(rows))
    for column in neighbours[:, 1:].T:
        other = _directions(xyz.take(column, axis=0))
        chords = np.maximum(chords, np.square(other - own).sum(axis=0))
    return max(float(np.sqrt(np.median(chords))), FINEST_STEP)


def _directions(xyz: NDArray[np.float32]) -> NDArray[np.float64]:
    """Unit vectors to some points, float64 (3, Q)."""
    axes = np.array(xyz.T, np.float64, order="C")
    length = np.maximum(np.sqrt(np.square(axes).sum(axis=0)), NEAREST_POINT)
    directions: NDArray[np.float64] = axes / length
    return directions


def crowding(xyz: NDArray[np.float32], step: float) -> NDArray[np.float32]:
    """How many others are near each point, each counting the less the farther it is.

    Only what lies near it along the curve is looked at, so that nothing is searched for: a crowded
    point is crowded for sure, and one that seems to be alone may not be.

    Args:
        xyz: Positions in the sensor's frame along a Morton curve, float32 (M, 3), metres.
        step: Angle between neighbouring beams, radians.

    Returns:
        From 0 to twice WINDOW, float32 (M,).
    """
    x, y, z = np.ascontiguousarray(xyz.T)
    squared = np.maximum(x * x + y * y + z * z, np.float32(NEAREST_POINT**2))
    per_half = 1 / (squared * np.float32((HALF_AT * step) ** 2))
    result = np.zeros(len(xyz), np.float32)
    for apart in range(1, min(WINDOW, len(xyz) - 1) + 1):
        before, after = slice(None, -apart), slice(apart, None)
        distance = np.square(x[after] - x[before])
        distance += np.square(y[after] - y[before])
        distance += np.square(z[after] - z[before])
        for side in (before, after):
            result[side] += 1 / (1 + distance * per_half[side])
    return result
