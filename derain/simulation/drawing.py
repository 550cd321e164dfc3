"""Numbers that are drawn between two others."""

import numpy as np
from numpy.typing import NDArray

# Lowest and highest value of what is drawn in between.
Span = tuple[float, float]


def evenly_in_logarithm(span: Span, generator: np.random.Generator) -> float:
    """A number between two positive ones: each doubling is as likely as any other."""
    low, high = np.log(span)
    return float(np.exp(generator.uniform(low, high)))


def many_evenly_in_logarithm(
    span: Span, count: int, generator: np.random.Generator
) -> NDArray[np.float64]:
    """As :func:`evenly_in_logarithm`, so many numbers, float64 (count,)."""
    low, high = np.log(span)
    return np.asarray(np.exp(generator.uniform(low, high, count)))
