"""Points on beams with even steps between them."""

import numpy as np


def sphere(rows: int, columns: int, step: float, distance: float) -> np.ndarray:
    """Points on a grid of beams with even steps, radians, at one distance."""
    azimuth = step * (np.arange(columns) - columns / 2)
    inclination = step * (np.arange(rows) - rows / 2)
    a, i = (grid.ravel() for grid in np.meshgrid(azimuth, inclination))
    unit = np.stack([np.cos(i) * np.cos(a), np.cos(i) * np.sin(a), np.sin(i)], axis=1)
    return (distance * unit).astype(np.float32)
