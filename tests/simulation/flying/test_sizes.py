"""Diameters against the integrals of their distribution, and what is seen of them by its power."""

import math
from dataclasses import replace

import numpy as np
import pytest

from derain.simulation.flying.precipitation import SMALLEST, Precipitation
from derain.simulation.flying.sizes import Optics, Sizes
from derain.simulation.sensor import Sensor


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


SENSOR = Sensor(aperture=0.005)


def power(optics: Optics, diameter: float, distance: float) -> float:
    width = float(optics.width(np.array([distance]))[0])
    return optics.brightness * min(diameter / width, 1) ** 2 / distance**2


@pytest.mark.parametrize("reach", [0.0, 5.0, 25.0, 80.0])
@pytest.mark.parametrize("spill", [1.0, 3.0])
def test_the_smallest_visible_particle_is_at_the_threshold(reach: float, spill: float) -> None:
    optics = Optics.of(Precipitation(reach=reach, spill=spill, diameter=2.0), SENSOR)
    for distance in (1.0, 4.0, 15.0):
        smallest = float(optics.smallest_visible(np.array([distance]))[0])
        assert power(optics, smallest, distance) == pytest.approx(SENSOR.detection_threshold)


@pytest.mark.parametrize("reach", [5.0, 25.0, 80.0])
def test_a_particle_of_the_mean_diameter_is_just_seen_at_the_reach(reach: float) -> None:
    for sensor in (SENSOR, replace(SENSOR, detection_threshold=1e-4, beam_divergence=5e-3)):
        optics = Optics.of(Precipitation(reach=reach, diameter=3.0), sensor)
        smallest = optics.smallest_visible(np.array([reach]))[0]
        assert smallest == pytest.approx(3e-3)


def test_nothing_is_seen_beyond_the_cut_off() -> None:
    optics = Optics.of(Precipitation(cut_off=7.0), SENSOR)
    seen = np.isfinite(optics.smallest_visible(np.array([6.9, 7.1])))
    assert seen.tolist() == [True, False]


def test_a_surface_too_dark_for_its_distance_is_seen_at_no_size() -> None:
    optics = Optics.of(Precipitation(reflectivity=0.01), SENSOR)
    farthest = math.sqrt(0.01 / SENSOR.detection_threshold)
    seen = np.isfinite(optics.smallest_visible(np.array([0.999, 1.001]) * farthest))
    assert seen.tolist() == [True, False]
