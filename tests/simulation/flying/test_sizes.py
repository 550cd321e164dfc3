"""Diameters against the integrals of their distribution."""

import math

import numpy as np
import pytest

from derain.simulation.flying.precipitation import SMALLEST
from derain.simulation.flying.sizes import Sizes


@pytest.mark.parametrize(("mean", "shape", "largest"), [(1, 1, 6), (3, 4, 20), (0.3, 1, 2)])
def test_moments_are_those_of_the_cut_gamma_distribution(
    mean: float, shape: float, largest: float
) -> None:
    sizes = Sizes.gamma(mean, shape, largest)
    diameter = np.linspace(SMALLEST, largest, 200_001)
    density = diameter ** (shape - 1) * np.exp(-shape * diameter / mean)
    density /= np.trapezoid(density, diameter)
    for power in (1, 2, 3):
        moment = np.trapezoid(density * (1e-3 * diameter) ** power, diameter)
        assert sizes.moment(power) == pytest.approx(moment, rel=1e-3)
    assert sizes.share.sum() == pytest.approx(1)
    assert sizes.extinction == pytest.approx(math.pi / 2 * sizes.moment(2))


@pytest.mark.parametrize("mean", [1e-3, 1e4])
def test_a_mean_far_outside_the_cut_leaves_finite_shares(mean: float) -> None:
    sizes = Sizes.gamma(mean, 5, 20)
    assert np.isfinite(sizes.share).all()
    assert sizes.share.sum() == pytest.approx(1)
