"""Where something that moves is."""

import numpy as np
from numpy.typing import NDArray

from derain.simulation.traffic import MovingThing


def moved(thing: MovingThing, time: float) -> NDArray[np.float64]:
    """Its triangles so many seconds after the first scan, float64 (T, 3, 3)."""
    return thing.surface.triangles + np.append(time * thing.velocity, 0)
