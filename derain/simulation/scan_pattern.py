"""Where the shots of a LiDAR point: on a grid of rows and columns, or along a rosette."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from derain.simulation.arrays import Floats


def unit_vectors(azimuth: ArrayLike, inclination: ArrayLike) -> Floats:
    """Unit vectors along directions.

    Args:
        azimuth: From x towards y, degrees.
        inclination: Above the horizon, degrees; the shapes of both are broadcast.

    Returns:
        float64 (N, 3) in row-major order; x forward, y left, z up.
    """
    azimuth, inclination = np.radians(azimuth), np.radians(inclination)
    x = np.cos(inclination) * np.cos(azimuth)
    y = np.cos(inclination) * np.sin(azimuth)
    z = np.broadcast_to(np.sin(inclination), x.shape)
    return np.stack([x, y, z], axis=-1).reshape(-1, 3)


def rosette(
    field: tuple[tuple[float, float], tuple[float, float]],
    shape: tuple[int, int],
    turns: tuple[float, float],
    offsets: Sequence[float],
) -> tuple[Floats, Floats]:
    """Directions of lasers that look through two wedge prisms, which turn at different speeds.

    Each prism deflects by half of what the two can do together, towards where it is turned to; the
    deflections add up, so that the shots fill an ellipse with a rosette.

    Args:
        field: The ellipse: right and left, lowest and highest direction, degrees.
        shape: Number of lasers and of shots that each fires in a scan.
        turns: Turns of each prism in a scan; the sign is the sense.
        offsets: Inclination of each laser off the common direction, degrees; none has the lasers
            fire along one curve in turn.

    Returns:
        Azimuth and inclination, degrees, float64 (lasers, shots) each.

    Source: Brazeal et al. 2021, "A rigorous observation model for the Risley prism-based Livox
    Mid-40 lidar sensor", here to the first order in the deflections.
    """
    lasers, shots = shape
    delay = np.zeros(lasers) if offsets else np.arange(lasers) / lasers
    share = (np.arange(shots) + delay[:, None]) / shots
    first, second = (2 * np.pi * turn * share for turn in turns)
    (right, left), (lowest, highest) = field
    azimuth = (left + right) / 2 + (left - right) / 4 * (np.cos(first) + np.cos(second))
    swing = (highest - lowest) / 4 * (np.sin(first) + np.sin(second))
    middle = (highest + lowest) / 2 + (np.array(offsets)[:, None] if offsets else 0.0)
    return azimuth, middle + swing
