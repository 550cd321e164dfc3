"""Diameters against the integrals of their distribution, and what is seen of them by its power."""

from dataclasses import replace

import numpy as np
import pytest

from derain.simulation.flying.optics import Optics, Sizes, Slices
from derain.simulation.flying.precipitation import SMALLEST, Precipitation
from derain.simulation.sensor import Sensor

SENSOR = Sensor(aperture=0.005)


@pytest.mark.parametrize(("mean", "shape", "largest"), [(1, 1, 6), (3, 4, 20), (0.3, 1, 2)])
def test_moments_are_those_of_the_cut_gamma_distribution(
    mean: float, shape: float, largest: float
) -> None:
    sizes = Sizes.gamma(mean, shape, largest)
    diameter = np.linspace(SMALLEST, largest, 200_001)
    density = diameter ** (shape - 1) * np.exp(-shape * diameter / mean)
    density /= np.trapezoid(density, diameter)
    for power in (0, 1, 2, 3):
        moment = np.trapezoid(density * (1e-3 * diameter) ** power, diameter)
        assert sizes.moment(power) == pytest.approx(moment, rel=1e-3)


@pytest.mark.parametrize("mean", [1e-3, 1e4])
def test_a_mean_far_outside_the_cut_leaves_finite_shares(mean: float) -> None:
    assert Sizes.gamma(mean, 5, 20).share.sum() == pytest.approx(1)


@pytest.mark.parametrize("reach", [0.0, 5.0, 80.0])
@pytest.mark.parametrize("spill", [1.0, 3.0])
def test_the_smallest_visible_particle_is_at_the_threshold(reach: float, spill: float) -> None:
    optics = Optics.of(Precipitation(reach=reach, spill=spill, diameter=2.0), SENSOR)
    distance = np.array([1.0, 4.0, 15.0])
    smallest = optics.smallest_visible(distance)
    width = spill * (0.005 + SENSOR.beam_spread * distance)
    power = optics.brightness * (smallest / width) ** 2 / distance**2
    assert power == pytest.approx(SENSOR.detection_threshold)
    if reach:
        assert optics.smallest_visible(np.array([reach])) == pytest.approx(2e-3)


def test_no_size_is_seen_beyond_the_cut_off_or_of_what_is_too_dark_for_its_distance() -> None:
    dark = Precipitation(reflectivity=0.01)
    too_far = np.sqrt(0.01 / SENSOR.detection_threshold)
    for precipitation, farthest in ((Precipitation(cut_off=7.0), 7.0), (dark, too_far)):
        optics = Optics.of(precipitation, SENSOR)
        seen = np.isfinite(optics.smallest_visible(farthest * np.array([0.999, 1.001])))
        assert seen.tolist() == [True, False]


def test_slices_count_what_would_be_seen_in_the_middle_of_a_beam() -> None:
    sensor = replace(SENSOR, aperture=0.0, maximum_range=60.0)
    optics, sizes = Optics.of(Precipitation(), sensor), Sizes.gamma(2.0, 1.0, 10.0)
    distance = np.linspace(1, 60, 20_001)
    width = optics.width(distance)[:, None]
    visible = sizes.diameter >= optics.smallest_visible(distance)[:, None]
    area = visible * np.pi / 4 * (width + sizes.diameter) ** 2
    exact = np.trapezoid((area * sizes.share).sum(axis=1), distance)
    # The slices are as wide as at their far end.
    assert exact < Slices(1.0, optics, sizes).met.sum() < 1.6 * exact
