"""Drops inside beams against closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import kstest, truncexpon

from derain.simulation.arrays import Floats
from derain.simulation.marshall_palmer import (
    LARGEST_DROP,
    SMALLEST_DROP,
    drops_per_cubic_metre,
    slope,
)
from derain.simulation.rain import (
    DROP_REFLECTIVITY,
    Drops,
    draw_drops,
    drop_reflectivity,
    farthest_visible_drop,
    thin_out,
)
from derain.simulation.rain_field import UniformRain
from derain.simulation.sensor import Sensor

CONE = Sensor()
FRUSTUM = replace(CONE, aperture=0.0095)
RATES = (10.0, 25.0, 50.0)
FORWARD = np.array([[1.0, 0.0, 0.0]])


class Ramp:
    """Rain that grows with the distance ahead, up to a rate."""

    heaviest = 50.0

    def rate(self, x: Floats, y: Floats) -> Floats:
        return np.clip(4 * x, 0, self.heaviest)


def drop_at(distance: float, diameter: float) -> Drops:
    return Drops(np.zeros(1, np.int64), np.array([distance]), np.array([diameter]))


@pytest.mark.parametrize("sensor", [CONE, FRUSTUM])
@pytest.mark.parametrize("rate", RATES)
def test_drops_per_beam_are_poisson_with_the_volume_of_the_beam(
    rate: float, sensor: Sensor
) -> None:
    beams, far = 20_000, 12.0
    drops = draw_drops(rate, np.full(beams, far), sensor, np.random.default_rng(2))
    counts = np.bincount(drops.beam, minlength=beams)

    distance = np.linspace(sensor.minimum_range, far, 100_001)
    radius = sensor.aperture / 2 + distance * math.tan(sensor.beam_divergence / 2)
    expected = drops_per_cubic_metre(rate) * np.trapezoid(np.pi * radius**2, distance)
    assert counts.mean() == pytest.approx(expected, abs=4 * math.sqrt(expected / beams))
    spread = math.sqrt((expected + 2 * expected**2) / beams)  # of a Poisson sample's variance
    assert counts.var() == pytest.approx(expected, abs=4 * spread)


@pytest.mark.parametrize("sensor", [CONE, FRUSTUM])
def test_distances_follow_the_cross_section_of_the_beam(sensor: Sensor) -> None:
    near, far = sensor.minimum_range, 15.0
    drops = draw_drops(25, np.full(20_000, far), sensor, np.random.default_rng(3))
    assert len(drops.range) > 10_000
    grid = np.linspace(near, far, 10_001)
    cross_section = (sensor.aperture + sensor.beam_spread * grid) ** 2
    steps = (cross_section[1:] + cross_section[:-1]) / 2
    share = np.append(0, np.cumsum(steps)) / steps.sum()
    assert kstest(drops.range, lambda distance: np.interp(distance, grid, share)).pvalue > 1e-3


def test_a_beam_that_ends_within_the_minimum_range_holds_no_drop() -> None:
    reach = np.full(10_000, CONE.minimum_range / 2)
    assert len(draw_drops(50, reach, CONE, np.random.default_rng(0)).beam) == 0


def test_even_rain_is_not_thinned() -> None:
    drops = draw_drops(25, np.full(1000, 15.0), CONE, np.random.default_rng(4))
    beams = np.repeat(FORWARD, 1000, axis=0)
    kept = thin_out(drops, beams, UniformRain(25), np.random.default_rng(5))
    assert (kept.range == drops.range).all()
    assert (kept.diameter == drops.diameter).all()


def test_uneven_rain_has_the_drops_of_the_rate_where_they_fall() -> None:
    """Number and diameter of the drops within each slice of the beams are those of its rate."""
    count, generator = 100_000, np.random.default_rng(6)
    beams = np.repeat(FORWARD, count, axis=0)
    drops = draw_drops(Ramp.heaviest, np.full(count, 15.0), CONE, generator)
    kept = thin_out(drops, beams, Ramp(), generator)
    for near in (2.0, 5.0, 9.0, 14.0):
        far = near + 0.1
        inside = (kept.range >= near) & (kept.range < far)
        rate = 4 * (near + far) / 2
        bounds = np.array([near]), np.array([far])
        expected = count * drops_per_cubic_metre(min(rate, 50)) * CONE.beam_volume(*bounds)[0]
        # The rate's change within the slice adds less than a hundredth.
        assert inside.sum() == pytest.approx(expected, abs=4 * math.sqrt(expected) + expected / 100)

        scale = 1 / float(slope(min(rate, 50)))
        longest = (LARGEST_DROP - SMALLEST_DROP) / scale
        diameters = truncexpon(longest, SMALLEST_DROP, scale)
        assert kstest(kept.diameter[inside], diameters.cdf).pvalue > 1e-3


def test_where_it_does_not_rain_no_drop_stays() -> None:
    beams = np.array([[1.0, 0, 0], [-1.0, 0, 0]])  # the ramp starts at the sensor
    drops = Drops(np.array([0, 1]), np.array([13.0, 13.0]), np.array([1.0, 1.0]))
    assert thin_out(drops, beams, Ramp(), np.random.default_rng(7)).beam.tolist() == [0]


def test_a_drop_returns_with_the_fourth_power_of_distance_until_it_fills_the_beam() -> None:
    def power(distance: float) -> float:
        return float(drop_reflectivity(drop_at(distance, 3.0), CONE)[0]) / distance**2

    filled = 3e-3 / CONE.beam_spread  # a drop of 3 mm is as wide as the beam at 2 m
    assert power(2 * filled) / power(4 * filled) == pytest.approx(2**4)
    assert power(filled / 4) / power(filled / 2) == pytest.approx(2**2)
    assert power(filled) == pytest.approx(DROP_REFLECTIVITY / filled**2)


def test_a_wide_beam_is_not_filled_at_any_distance() -> None:
    reflectivity = drop_reflectivity(drop_at(1.0, 3.0), FRUSTUM)[0]
    assert reflectivity == pytest.approx(DROP_REFLECTIVITY * (3 / (9.5 + 1.5)) ** 2)


@pytest.mark.parametrize("sensor", [CONE, FRUSTUM])
def test_the_largest_drop_is_at_the_threshold_where_visibility_ends(sensor: Sensor) -> None:
    horizon = farthest_visible_drop(sensor)
    power = drop_reflectivity(drop_at(horizon, LARGEST_DROP), sensor)[0] / horizon**2
    assert power == pytest.approx(sensor.detection_threshold)
