"""How numbers are drawn for what stands in a place."""

import numpy as np
from numpy.typing import NDArray

Span = tuple[float, float]


def evenly_in_logarithm(span: Span, generator: np.random.Generator) -> float:
    """A number between two positive ones: each doubling is as likely as any other."""
    return float(np.exp(generator.uniform(*np.log(span))))


def many_evenly_in_logarithm(
    span: Span, count: int, generator: np.random.Generator
) -> NDArray[np.float64]:
    """As :func:`evenly_in_logarithm`, so many numbers, float64 (count,)."""
    low, high = np.log(span)
    return np.asarray(np.exp(generator.uniform(low, high, count)))


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
