"""Drop sizes and extinction against published figures and numerical integrals."""

import math

import numpy as np
import pytest
from scipy.stats import kstest, truncexpon

from derain.simulation.marshall_palmer import (
    INTERCEPT,
    LARGEST_DROP,
    SMALLEST_DROP,
    draw_diameters,
    drops_per_cubic_metre,
    extinction,
    slope,
)

RATES = (10.0, 25.0, 50.0)


@pytest.mark.parametrize(
    ("rate", "steepness", "mean_diameter", "density", "share_per_metre"),
    [
        (10, 2.5280, 0.396, 894.0, 1.556e-3),
        (25, 2.0855, 0.479, 1352.1, 2.771e-3),
        (50, 1.8030, 0.555, 1801.1, 4.288e-3),
    ],
)
def test_rain_has_the_figures_of_marshall_and_palmer(
    rate: float, steepness: float, mean_diameter: float, density: float, share_per_metre: float
) -> None:
    assert slope(rate) == pytest.approx(steepness, abs=5e-5)
    assert 1 / slope(rate) == pytest.approx(mean_diameter, abs=5e-4)
    assert drops_per_cubic_metre(rate) == pytest.approx(density, abs=0.05)
    assert extinction(rate) == pytest.approx(share_per_metre, abs=5e-7)


@pytest.mark.parametrize("rate", RATES)
def test_extinction_is_the_integral_over_the_cross_sections_of_all_drops(rate: float) -> None:
    diameter = np.linspace(0, 40, 400_001)
    cross_section = 1e-6 * np.pi / 4 * diameter**2  # m²
    density = INTERCEPT * np.exp(-slope(rate) * diameter)
    integral = np.trapezoid(2 * cross_section * density, diameter)
    assert extinction(rate) == pytest.approx(integral, rel=1e-6)


def test_no_rain_has_no_drops_and_takes_no_light() -> None:
    assert drops_per_cubic_metre(0) == 0
    assert extinction(0) == 0
    assert len(draw_diameters(0, 0, np.random.default_rng(0))) == 0


def test_an_array_of_rates_gives_what_each_rate_gives_alone() -> None:
    rates = np.array([[0.0, 1.0, 10.0], [25.0, 50.0, 200.0]])
    for of_rate in (slope, extinction):
        alone = [[float(of_rate(rate)) for rate in row] for row in rates]
        assert np.allclose(of_rate(rates), alone)
        assert of_rate(rates).shape == rates.shape


@pytest.mark.parametrize("rate", RATES)
def test_diameters_follow_the_exponential_cut_at_both_ends(rate: float) -> None:
    steepness = float(slope(rate))
    sample = draw_diameters(rate, 100_000, np.random.default_rng(1))
    assert SMALLEST_DROP <= sample.min() < sample.max() <= LARGEST_DROP

    longest = steepness * (LARGEST_DROP - SMALLEST_DROP)
    cut = truncexpon(longest, SMALLEST_DROP, 1 / steepness)
    assert kstest(sample, cut.cdf).pvalue > 1e-3

    for power in (1, 2, 3):
        error = (sample**power).std() / math.sqrt(len(sample))
        assert (sample**power).mean() == pytest.approx(cut.moment(power), abs=4 * error)
