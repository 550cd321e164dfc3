"""Where things stand that are set up one after the other."""

import numpy as np

from derain.simulation.drawing import Span


def along(begin: float, end: float, spacing: Span, generator: np.random.Generator) -> list[float]:
    """Places from a first to a last one, uneven steps apart.

    Args:
        begin: The first is at most one step after it.
        end: The last is before it.
        spacing: Least and greatest step.
        generator: Random generator.
    """
    places = []
    place = begin + generator.uniform(0, spacing[1])
    while place < end:
        places.append(place)
        place += generator.uniform(*spacing)
    return places
