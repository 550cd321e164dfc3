"""Directions by their angles."""

import numpy as np
from numpy.typing import ArrayLike, NDArray


def unit_vectors(azimuth: ArrayLike, inclination: ArrayLike) -> NDArray[np.float64]:
    """Vectors of length one at angles in degrees, float64 (..., 3)."""
    azimuth, inclination = np.broadcast_arrays(np.radians(azimuth), np.radians(inclination))
    level = np.cos(inclination)
    return np.stack(
        [level * np.cos(azimuth), level * np.sin(azimuth), np.sin(inclination)], axis=-1
    )
