"""What rain does to the returns of beams, against numerical integrals and a loop over beams."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import Generator

from derain.simulation import rain as rain_module
from derain.simulation.arrays import Floats
from derain.simulation.classes import TrackClass
from derain.simulation.marshall_palmer import (
    INTERCEPT,
    LARGEST_DROP,
    SMALLEST_DROP,
    draw_diameters,
    extinction,
    slope,
)
from derain.simulation.rain import (
    DROP_REFLECTIVITY,
    Drops,
    Transmission,
    draw_drops,
    drop_reflectivity,
    rain_on_beams,
)
from derain.simulation.rain_field import RainField, SprinkledRain, UniformRain
from derain.simulation.sensor import Returns, Sensor

from .surfaces import random_surfaces, surfaces

SENSOR = Sensor()
DUAL, LAST = replace(SENSOR, returns="dual"), replace(SENSOR, returns="last")
RATES = (10.0, 25.0, 50.0)


def open_air(count: int) -> Returns:
    return surfaces(count, SENSOR.maximum_range, 0.0, TrackClass.BACKGROUND)


def rained(clear: Returns, rain: RainField, seed: int, sensor: Sensor = SENSOR) -> Returns:
    """The returns of beams that point straight ahead."""
    beams = np.tile([1.0, 0.0, 0.0], (len(clear.range), 1))
    return rain_on_beams(clear, beams, rain, sensor, np.random.default_rng(seed))


@pytest.mark.parametrize("rate", RATES)
def test_open_beams_see_as_much_rain_as_the_integral_over_visible_drops(rate: float) -> None:
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


def test_surfaces_fade_with_the_way_there_and_back() -> None:
    distance = 30.0
    detected = rained(surfaces(1000, distance, 0.8), UniformRain(50), seed=5)
    kept = detected.label == TrackClass.CAR
    assert kept.sum() > 900
    assert np.allclose(detected.reflectivity[kept], 0.8 * np.exp(-2 * extinction(50) * distance))
    assert (detected.range[kept] == distance).all()


def crowded(clear: Returns, generator: Generator, monkeypatch: pytest.MonkeyPatch) -> Drops:
    """Lets ten times the drops fall, so that many beams hold several visible ones."""
    some = draw_drops(25, np.minimum(clear.range, 15), SENSOR, generator)
    diameter = draw_diameters(25, 10 * len(some.beam), generator)
    drops = Drops(np.tile(some.beam, 10), np.tile(some.range, 10), diameter)
    # The same place twice is the same range twice: told apart, the last return is one of them.
    drops = Drops(drops.beam, drops.range * generator.uniform(0.9, 1, len(diameter)), diameter)
    monkeypatch.setattr(rain_module, "draw_drops", lambda *_: drops)
    return drops


def test_the_strongest_and_the_last_of_all_that_a_beam_meets_are_reported(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
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


@settings(max_examples=25, deadline=None)
@given(
    rate=st.floats(0, 200),
    seed=st.integers(0, 2**32),
    sensor=st.sampled_from([SENSOR, LAST, DUAL, replace(SENSOR, aperture=0.01)]),
)
def test_energy_never_grows_and_a_beam_is_kept_weaker_or_ends_at_a_drop_or_is_lost(
    rate: float, seed: int, sensor: Sensor
) -> None:
    clear = random_surfaces(2000, np.random.default_rng(seed))
    detected = rained(clear, UniformRain(rate), seed, sensor)
    returned = detected.returned
    wet = returned & (detected.label == TrackClass.RAIN)
    kept = returned & ~wet
    beam = detected.beam

    assert set(beam) == set(range(2000))
    assert (np.diff(beam) >= 0).all()
    assert (detected.power[returned] >= sensor.detection_threshold * (1 - 1e-12)).all()
    assert (detected.range[kept] == clear.range[beam[kept]]).all()
    assert (detected.label[kept] == clear.label[beam[kept]]).all()
    assert (detected.reflectivity[kept] <= clear.reflectivity[beam[kept]]).all()
    assert (detected.range[wet] <= clear.range[beam[wet]]).all()
    assert (detected.range[wet] >= sensor.minimum_range * (1 - 1e-12)).all()
    assert (detected.reflectivity[wet] <= DROP_REFLECTIVITY).all()
    assert (detected.label[~returned] == TrackClass.BACKGROUND).all()
    assert (detected.range[~returned] == sensor.maximum_range).all()


def test_the_last_return_reports_less_rain_than_the_strongest() -> None:
    clear = surfaces(20_000, 60.0, 0.05)
    strongest, last, dual = (
        rained(clear, UniformRain(50), 1, sensor) for sensor in (SENSOR, LAST, DUAL)
    )
    rain = [(returns.label == TrackClass.RAIN).sum() for returns in (strongest, last, dual)]
    assert rain[1] == 0  # a surface that is seen is behind every drop
    assert rain[0] == rain[2] > 1000
    assert len(dual.range) == 20_000 + rain[0]


def test_clear_air_leaves_what_the_threshold_lets_through() -> None:
    clear = random_surfaces(5000, np.random.default_rng(7))
    detected = rained(clear, UniformRain(0), seed=8)
    visible = clear.power >= SENSOR.detection_threshold
    assert 0 < visible.sum() < 5000
    assert (detected.returned == visible).all()
    assert (detected.reflectivity[visible] == clear.reflectivity[visible]).all()
    assert (detected.label[visible] == clear.label[visible]).all()


def test_more_rain_loses_more_of_the_surfaces_that_clear_air_shows() -> None:
    clear = random_surfaces(50_000, np.random.default_rng(9))
    visible = clear.power >= SENSOR.detection_threshold
    kept, lost = [], []
    for rate in (0, *RATES, 100):
        detected = rained(clear, UniformRain(rate), seed=10)
        kept.append(np.count_nonzero(detected.returned & (detected.label != TrackClass.RAIN)))
        lost.append(np.count_nonzero(visible & ~detected.returned))
    # Each step changes more than the two hundred that chance could give back.
    assert (np.diff(kept) < -400).all(), kept
    assert (np.diff(lost) > 200).all(), lost


def test_it_rains_where_the_field_rains() -> None:
    beams = Sensor(azimuth=(-180, 180), inclination=(-1, 1), rows=20, columns=2000).beams()
    clear = open_air(len(beams))
    detected = rain_on_beams(clear, beams, SprinkledRain(50), SENSOR, np.random.default_rng(12))
    x, y, _ = (beams * detected.range[:, None])[detected.returned].T
    assert len(x) > 1000
    assert (np.abs(y) < 14).all()  # where the sprinklers throw no more
    assert (x > -16).all()
    assert np.count_nonzero(x > 8) > 50


def test_a_scan_without_beams_stays_empty() -> None:
    for sensor in (SENSOR, LAST, DUAL):
        assert len(rained(open_air(0), UniformRain(25), 0, sensor).range) == 0


def random_beams(count: int, generator: Generator) -> Floats:
    beams = generator.normal(size=(count, 3))
    return beams / np.linalg.norm(beams, axis=1, keepdims=True)


def integrated(rain: RainField, beam: Floats, distance: float) -> float:
    way = np.linspace(0, distance, 2001)
    depth = np.trapezoid(extinction(rain.rate(way * beam[0], way * beam[1])), way)
    return float(np.exp(-2 * depth))


def test_even_rain_takes_light_exponentially_in_every_direction() -> None:
    generator = np.random.default_rng(0)
    beams = np.concatenate([random_beams(1000, generator), [[0, 0, 1], [0, 0, -1], [-1, 0, 0]]])
    distance = generator.uniform(0, 300, len(beams))  # also farther than the field is sampled
    share = Transmission(UniformRain(50), 120)(beams, distance)
    assert np.allclose(share, np.exp(-2 * extinction(50) * distance), rtol=1e-12)


@pytest.mark.parametrize("nominal", [10.0, 25.0, 50.0])
def test_uneven_rain_takes_light_by_the_integral_along_each_beam(nominal: float) -> None:
    rain, generator = SprinkledRain(nominal), np.random.default_rng(2)
    beams = random_beams(300, generator)
    beams[::2, :2] = [1, 0]  # half of them down the track, at all inclinations
    beams /= np.linalg.norm(beams, axis=1, keepdims=True)
    distance = generator.uniform(0.5, 110, len(beams))
    share = Transmission(rain, 120)(beams, distance)
    expected = [
        integrated(rain, beam, float(end)) for beam, end in zip(beams, distance, strict=True)
    ]
    assert np.abs(share - expected).max() < 0.01
    assert np.ptp(expected) > 0.1
