"""What beams return through clear air."""

import numpy as np
from numpy.random import Generator

from derain.simulation.classes import TrackClass
from derain.simulation.sensor import Returns, Sensor

FARTHEST = Sensor().maximum_range


def surfaces(
    count: int, distance: float, reflectivity: float, label: TrackClass = TrackClass.CAR
) -> Returns:
    """Beams that meet the same."""
    return Returns(
        np.full(count, distance),
        np.full(count, reflectivity),
        np.full(count, int(label)),
        np.arange(count),
    )


def random_surfaces(count: int, generator: Generator) -> Returns:
    """Surfaces near and far, bright and too dark to be seen, and beams that meet nothing."""
    nothing = generator.random(count) < 0.2
    return Returns(
        np.where(nothing, FARTHEST, generator.uniform(1, 100, count)),
        np.where(nothing, 0, 10 ** generator.uniform(-5, 0, count)),
        np.where(nothing, 0, generator.choice([0, 1, 2, 4, 5, 6, 7], count)),
        np.arange(count),
    )
