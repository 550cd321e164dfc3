"""Drops in beams, and what they do to returns, against integrals and loops over beams."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import Generator
from scipy.stats import kstest, truncexpon

from derain.scan import Floats
from derain.simulation import rain as rain_module
from derain.simulation.classes import TrackClass
from derain.simulation.rain import (
    DROP_REFLECTIVITY,
    LARGEST_DROP,
    SMALLEST_DROP,
    Drops,
    Transmission,
    draw_diameters,
    draw_drops,
    drop_reflectivity,
    drops_per_cubic_metre,
    farthest_visible_drop,
    rain_on_beams,
    thin_out,
)
from derain.simulation.rain_field import (
    INTERCEPT,
    RainField,
    SprinkledRain,
    UniformRain,
    extinction,
    slope,
)
from derain.simulation.sensor import Returns, Sensor

from .surfaces import (
    assert_kept_weaker_or_ends_at_a_particle_or_lost,
    random_surfaces,
    surfaces,
)

SENSOR = Sensor()
FRUSTUM = replace(SENSOR, aperture=0.0095)
DUAL, LAST = replace(SENSOR, returns="dual"), replace(SENSOR, returns="last")
RATES = (10.0, 25.0, 50.0)


class Ramp:
    """Rain that grows with the distance ahead, up to a rate."""

    heaviest = 50.0

    def rate(self, x: Floats, y: Floats) -> Floats:
        return np.clip(4 * x, 0, self.heaviest)


def cut_exponential(rate: float) -> truncexpon:
    """The distribution of diameters of the drops that are drawn."""
    scale = 1 / float(slope(rate))
    return truncexpon((LARGEST_DROP - SMALLEST_DROP) / scale, SMALLEST_DROP, scale)


def open_air(count: int) -> Returns:
    return surfaces(count, SENSOR.maximum_range, 0.0, TrackClass.BACKGROUND)


def rained(clear: Returns, rain: RainField, seed: int, sensor: Sensor = SENSOR) -> Returns:
    """The returns of beams that point straight ahead."""
    beams = np.tile([1.0, 0.0, 0.0], (len(clear.range), 1))
    return rain_on_beams(clear, beams, rain, sensor, np.random.default_rng(seed))


@pytest.mark.parametrize("sensor", [SENSOR, FRUSTUM])
def test_drops_are_poisson_with_the_volume_of_the_beam_and_even_in_it(sensor) -> None:
    beams, far = 20_000, 12.0
    drops = draw_drops(25, np.full(beams, far), sensor, np.random.default_rng(2))
    counts = np.bincount(drops.beam, minlength=beams)
    distance, step = np.linspace(sensor.minimum_range, far, 10_001, retstep=True)
    cross_section = np.pi / 4 * (sensor.aperture + sensor.beam_spread * distance) ** 2
    volume = np.append(0, np.cumsum((cross_section[1:] + cross_section[:-1]) / 2) * step)
    expected = drops_per_cubic_metre(25) * volume[-1]
    assert counts.mean() == pytest.approx(expected, abs=4 * math.sqrt(expected / beams))
    spread = math.sqrt((expected + 2 * expected**2) / beams)  # of a Poisson sample's variance
    assert counts.var() == pytest.approx(expected, abs=4 * spread)
    passed = np.interp(drops.range, distance, volume / volume[-1])
    assert kstest(passed, "uniform").pvalue > 1e-3
    within = np.full(beams, sensor.minimum_range / 2)  # and so without any drop
    assert len(draw_drops(50, within, sensor, np.random.default_rng(0)).beam) == 0
    assert len(rained(open_air(0), UniformRain(25), 0, sensor).range) == 0


def test_uneven_rain_has_the_drops_of_the_rate_where_they_fall() -> None:
    """Number and diameter of the drops within each slice of the beams are those of its rate."""
    count, generator = 100_000, np.random.default_rng(6)
    beams = np.tile([1.0, 0.0, 0.0], (count, 1))
    drops = draw_drops(Ramp.heaviest, np.full(count, 15.0), SENSOR, generator)
    kept = thin_out(drops, beams, Ramp(), generator)
    for near in (2.0, 5.0, 9.0, 14.0):
        far = near + 0.1
        inside = (kept.range >= near) & (kept.range < far)
        rate = min(4 * (near + far) / 2, 50)
        widths = SENSOR.beam_width(far) ** 3 - SENSOR.beam_width(near) ** 3
        volume = np.pi / 12 / SENSOR.beam_spread * widths  # of the cone between them
        expected = count * drops_per_cubic_metre(rate) * volume
        # The rate's change within the slice adds less than a hundredth.
        assert inside.sum() == pytest.approx(expected, abs=4 * math.sqrt(expected) + expected / 100)
        assert kstest(kept.diameter[inside], cut_exponential(rate).cdf).pvalue > 1e-3
    behind = thin_out(drops, -beams, Ramp(), generator)  # where it does not rain
    assert len(behind.beam) == 0


@pytest.mark.parametrize("sensor", [SENSOR, FRUSTUM])
def test_the_largest_drop_is_at_the_threshold_where_visibility_ends(sensor) -> None:
    horizon = farthest_visible_drop(sensor)
    largest = Drops(np.zeros(1, np.int64), np.array([horizon]), np.array([LARGEST_DROP]))
    power = drop_reflectivity(largest, sensor)[0] / horizon**2
    assert power == pytest.approx(sensor.detection_threshold)


@pytest.mark.parametrize("rate", RATES)
def test_open_beams_see_as_much_rain_as_the_integral_over_visible_drops(rate) -> None:
    """A visible drop is at least as wide as D(r) where its power is the threshold.

    The visible drops of a beam are a Poisson process, so the share of beams with none is
    exp(−their expected number), here a plain integral over distance.
    """
    beams, steepness = 40_000, float(slope(rate))
    distance = np.linspace(SENSOR.minimum_range, SENSOR.maximum_range, 400_001)
    needed = SENSOR.detection_threshold * distance**2 * np.exp(2 * extinction(rate) * distance)
    width = 1e3 * SENSOR.beam_spread * distance * np.sqrt(needed / DROP_REFLECTIVITY)
    width = np.clip(width, SMALLEST_DROP, LARGEST_DROP)
    density = np.exp(-steepness * width) - math.exp(-steepness * LARGEST_DROP)
    cross_section = math.pi / 4 * (SENSOR.beam_spread * distance) ** 2
    visible = np.trapezoid(INTERCEPT / steepness * density * cross_section, distance)
    share = 1 - math.exp(-visible)

    detected = rained(open_air(beams), UniformRain(rate), seed=4)
    error = math.sqrt(share * (1 - share) / beams)
    assert detected.returned.mean() == pytest.approx(share, abs=4 * error)
    assert set(detected.label[detected.returned]) == {TrackClass.RAIN}


def crowded(clear: Returns, generator: Generator, monkeypatch: pytest.MonkeyPatch) -> Drops:
    """Lets ten times the drops fall, so that many beams hold several visible ones."""
    some = draw_drops(25, np.minimum(clear.range, 15), SENSOR, generator)
    diameter = draw_diameters(25, 10 * len(some.beam), generator)
    drops = Drops(np.tile(some.beam, 10), np.tile(some.range, 10), diameter)
    # The same place twice is the same range twice: kept apart, the last return is one of them.
    drops = Drops(drops.beam, drops.range * generator.uniform(0.9, 1, len(diameter)), diameter)
    monkeypatch.setattr(rain_module, "draw_drops", lambda *_: drops)
    return drops


def test_the_strongest_and_the_last_of_all_that_a_beam_meets_are_reported(monkeypatch) -> None:
    generator, rain = np.random.default_rng(6), UniformRain(25)
    clear = random_surfaces(300, generator)
    drops = crowded(clear, generator, monkeypatch)
    water = drop_reflectivity(drops, SENSOR)
    strongest, last, dual = (rained(clear, rain, 0, sensor) for sensor in (SENSOR, LAST, DUAL))
    seen_several = 0
    for beam in range(300):
        met = [(clear.reflectivity[beam], clear.range[beam], clear.label[beam])]
        met += [
            (water[drop], drops.range[drop], TrackClass.RAIN)
            for drop in np.flatnonzero(drops.beam == beam)
        ]
        received = [
            (reflectivity * np.exp(-2 * extinction(25) * distance) / distance**2, distance, label)
            for reflectivity, distance, label in met
        ]
        detectable = [one for one in received if one[0] >= SENSOR.detection_threshold]
        by_power = max(detectable, key=lambda one: one[0], default=None)
        by_range = max(detectable, key=lambda one: one[1], default=None)
        both = [by_power] if by_power == by_range else [by_power, by_range]
        seen_several += len(both) == 2
        for returns, expected in ((strongest, [by_power]), (last, [by_range]), (dual, both)):
            rows = np.flatnonzero(returns.beam == beam)
            assert len(rows) == len(expected)
            for row, one in zip(rows, expected, strict=True):
                if one is None:
                    assert not returns.returned[row]
                else:
                    assert returns.power[row] == pytest.approx(one[0])
                    assert returns.range[row] == pytest.approx(one[1])
                    assert returns.label[row] == one[2]
    assert seen_several > 20
    kinds = np.where(strongest.returned, strongest.label == TrackClass.RAIN, -1)
    assert set(kinds) == {-1, 0, 1}  # lost, kept, rain


@settings(max_examples=25)
@given(
    rate=st.floats(0, 200),
    seed=st.integers(0, 2**32),
    sensor=st.sampled_from([SENSOR, LAST, DUAL, replace(SENSOR, aperture=0.01)]),
)
def test_energy_never_grows_and_a_beam_is_kept_weaker_or_ends_at_a_drop_or_is_lost(
    rate, seed, sensor
) -> None:
    clear = random_surfaces(2000, np.random.default_rng(seed))
    detected = rained(clear, UniformRain(rate), seed, sensor)
    assert_kept_weaker_or_ends_at_a_particle_or_lost(clear, detected, sensor)
    wet = detected.label == TrackClass.RAIN
    assert (detected.reflectivity[wet] <= DROP_REFLECTIVITY).all()


def test_clear_air_leaves_what_the_threshold_lets_through() -> None:
    clear = random_surfaces(5000, np.random.default_rng(7))
    sensor = replace(SENSOR, minimum_range=10.0)
    detected = rained(clear, UniformRain(0), 8, sensor)
    visible = (clear.power >= sensor.detection_threshold) & (clear.range >= 10)
    assert 0 < visible.sum() < 5000
    assert (detected.returned == visible).all()
    assert (detected.reflectivity[visible] == clear.reflectivity[visible]).all()
    assert (detected.label[visible] == clear.label[visible]).all()


def random_beams(count: int, generator: Generator) -> Floats:
    beams = generator.normal(size=(count, 3))
    return beams / np.linalg.norm(beams, axis=1, keepdims=True)


def test_even_rain_takes_light_exponentially_in_every_direction() -> None:
    generator = np.random.default_rng(0)
    beams = np.concatenate([random_beams(1000, generator), [[0, 0, 1], [0, 0, -1], [-1, 0, 0]]])
    distance = generator.uniform(0, 300, len(beams))  # also farther than the field is sampled
    share = Transmission(UniformRain(50), 120)(beams, distance)
    assert np.allclose(share, np.exp(-2 * extinction(50) * distance), rtol=1e-12)


@pytest.mark.parametrize("nominal", [10.0, 50.0])
def test_uneven_rain_takes_light_by_the_integral_along_each_beam(nominal) -> None:
    rain, generator = SprinkledRain(nominal), np.random.default_rng(2)
    beams = random_beams(200, generator)
    beams[::2, :2] = [1, 0]  # half of them down the track, at all inclinations
    beams /= np.linalg.norm(beams, axis=1, keepdims=True)
    distance = generator.uniform(0.5, 110, len(beams))
    way = np.linspace(0, distance, 1001)
    depth = np.trapezoid(extinction(rain.rate(way * beams[:, 0], way * beams[:, 1])), way, axis=0)
    share = Transmission(rain, 120)(beams, distance)
    assert np.abs(share - np.exp(-2 * depth)).max() < 0.01
    assert np.ptp(share) > 0.1
