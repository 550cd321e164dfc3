"""Directions of points, as azimuth and inclination in degrees."""

import numpy as np

from derain.scan import Float32s, Floats


def directions(xyz: Float32s) -> tuple[Floats, Floats]:
    """Azimuth and inclination of every point.

    Args:
        xyz: Finite coordinates, float32 (N, 3), metres in the sensor frame.

    Returns:
        Azimuth, counter-clockwise from x (forward) towards y (left), float64 (N,), degrees in
        [-180, 180]; and inclination above the horizon, float64 (N,), degrees in [-90, 90]. Zeros
        count as positive: straight behind is 180, and above and below the sensor, where every
        azimuth would do, it is 0.
    """
    # Adding 0 makes zeros positive: arctan2 distinguishes -0.0 from 0.0.
    x, y, z = np.ascontiguousarray(xyz.T, dtype=np.float64) + 0.0
    azimuth = np.degrees(np.arctan2(y, x))
    inclination = np.degrees(np.arctan2(z, np.sqrt(x * x + y * y)))
    return azimuth, inclination
