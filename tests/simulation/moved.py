"""Where something that moves is."""

import numpy as np

from derain.simulation.arrays import Floats
from derain.simulation.traffic import MovingThing


def moved(thing: MovingThing, time: float) -> Floats:
    """Its triangles so many seconds after the first scan, float64 (T, 3, 3)."""
    return thing.surface.triangles + np.append(time * thing.velocity, 0)
