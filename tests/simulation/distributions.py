"""How far samples are from the distributions that they were drawn from."""

import math

import numpy as np
from numpy.typing import NDArray

# A statistic above this comes of one in a thousand samples.
SELDOM = 1.95


def largest_deviation(sample: NDArray[np.float64], cumulative: NDArray[np.float64]) -> float:
    """Kolmogorov and Smirnov's statistic times √n, of a sorted sample; seldom above SELDOM."""
    steps = np.arange(len(sample) + 1) / len(sample)
    ahead, behind = np.abs(cumulative - steps[:-1]).max(), np.abs(cumulative - steps[1:]).max()
    return math.sqrt(len(sample)) * float(max(ahead, behind))
