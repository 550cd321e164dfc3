"""Random numbers between two bounds, places along a line, and things by their weights."""

from collections.abc import Mapping
from typing import TypeVar

import numpy as np
from numpy.random import Generator

from derain.scan import Floats

T = TypeVar("T")

# Least and greatest value.
Span = tuple[float, float]


def log_uniform(span: Span, generator: Generator) -> float:
    """A number between two positive ones, uniform in its logarithm."""
    low, high = np.log(span)
    return float(np.exp(generator.uniform(low, high)))


def log_uniforms(span: Span, count: int, generator: Generator) -> Floats:
    """Several numbers as of :func:`log_uniform`, float64 (count,)."""
    low, high = np.log(span)
    return np.asarray(np.exp(generator.uniform(low, high, count)))


def along(begin: float, end: float, spacing: Span, generator: Generator) -> list[float]:
    """Places along a line, uneven steps apart.

    Args:
        begin: The first place is at most one step after it.
        end: The last place is before it.
        spacing: Least and greatest step.
        generator: Random generator.
    """
    places = []
    place = begin + generator.uniform(0, spacing[1])
    while place < end:
        places.append(place)
        place += generator.uniform(*spacing)
    return places


def pick(weights: Mapping[T, float], generator: Generator) -> T:
    """One of several things by their weights, which need not add up to 1."""
    share = np.array(list(weights.values())) / sum(weights.values())
    return list(weights)[generator.choice(len(weights), p=share)]
