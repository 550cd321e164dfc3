"""Rain on beams against closed forms, numerical integrals and a loop over beams."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from derain.errors import InputError
from derain.simulation import rain as rain_module
from derain.simulation.classes import TrackClass
from derain.simulation.rain import (
    DROP_REFLECTIVITY,
    INTERCEPT,
    LARGEST_DROP,
    SMALLEST_DROP,
    Drops,
    Rain,
    draw_drops,
    drop_reflectivity,
    farthest_visible_drop,
    rain_on_beams,
)
from derain.simulation.sensor import Returns, Sensor

SENSOR = Sensor()
RATES = (10.0, 25.0, 50.0)


def surfaces(
    distance: float, reflectivity: float, count: int, label: TrackClass = TrackClass.CAR
) -> Returns:
    return Returns(
        np.full(count, distance), np.full(count, reflectivity), np.full(count, int(label))
    )


def open_air(count: int) -> Returns:
    return surfaces(SENSOR.maximum_range, 0.0, count, TrackClass.BACKGROUND)


def random_surfaces(count: int, generator: np.random.Generator) -> Returns:
    """Surfaces near and far, bright and too dark to be seen, and beams that meet nothing."""
    nothing = generator.random(count) < 0.2
    return Returns(
        np.where(nothing, SENSOR.maximum_range, generator.uniform(1, 100, count)),
        np.where(nothing, 0, 10 ** generator.uniform(-5, 0, count)),
        np.where(nothing, 0, generator.choice([0, 1, 2, 4, 5, 6, 7], count)),
    )


def largest_deviation(sample: NDArray[np.float64], cumulative: NDArray[np.float64]) -> float:
    """Kolmogorov and Smirnov's statistic times √n: above 1.95 in one of a thousand samples."""
    steps = np.arange(len(sample) + 1) / len(sample)
    ahead, behind = np.abs(cumulative - steps[:-1]).max(), np.abs(cumulative - steps[1:]).max()
    return math.sqrt(len(sample)) * float(max(ahead, behind))


@pytest.mark.parametrize(
    ("rate", "slope", "mean_diameter", "density", "extinction"),
    [
        (10, 2.5280, 0.396, 894.0, 1.556e-3),
        (25, 2.0855, 0.479, 1352.1, 2.771e-3),
        (50, 1.8030, 0.555, 1801.1, 4.288e-3),
    ],
)
def test_rain_has_the_figures_of_marshall_and_palmer(
    rate: float, slope: float, mean_diameter: float, density: float, extinction: float
) -> None:
    rain = Rain(rate)
    assert rain.slope == pytest.approx(slope, abs=5e-5)
    assert 1 / rain.slope == pytest.approx(mean_diameter, abs=5e-4)
    assert rain.drops_per_cubic_metre == pytest.approx(density, abs=0.05)
    assert rain.extinction == pytest.approx(extinction, abs=5e-7)


@pytest.mark.parametrize("rate", RATES)
def test_extinction_is_the_integral_over_the_cross_sections_of_all_drops(rate: float) -> None:
    rain = Rain(rate)
    diameter = np.linspace(0, 40, 400_001)
    cross_section = 1e-6 * np.pi / 4 * diameter**2  # m²
    density = INTERCEPT * np.exp(-rain.slope * diameter)
    integral = np.trapezoid(2 * cross_section * density, diameter)
    assert rain.extinction == pytest.approx(integral, rel=1e-6)


def test_no_rain_has_no_drops_and_takes_no_light() -> None:
    clear = Rain(0)
    assert clear.drops_per_cubic_metre == 0
    assert clear.extinction == 0
    assert clear.transmission(np.array([1.0, 100.0])).tolist() == [1, 1]


@pytest.mark.parametrize("rate", [-1.0, math.inf, math.nan])
def test_a_rate_that_is_no_rain_rate_is_refused(rate: float) -> None:
    with pytest.raises(InputError, match="rain rate"):
        Rain(rate)


@pytest.mark.parametrize("rate", RATES)
def test_diameters_follow_the_exponential_cut_at_both_ends(rate: float) -> None:
    rain = Rain(rate)
    sample = np.sort(rain.draw_diameters(100_000, np.random.default_rng(1)))
    assert sample[0] >= SMALLEST_DROP
    assert sample[-1] <= LARGEST_DROP

    tail = np.exp(-rain.slope * np.array([SMALLEST_DROP, LARGEST_DROP]))
    cumulative = (tail[0] - np.exp(-rain.slope * sample)) / (tail[0] - tail[1])
    assert largest_deviation(sample, cumulative) < 1.95

    diameter = np.linspace(SMALLEST_DROP, LARGEST_DROP, 100_001)
    density = np.exp(-rain.slope * diameter)
    for power in (1, 2, 3):
        moment = np.trapezoid(diameter**power * density, diameter) / np.trapezoid(density, diameter)
        error = (sample**power).std() / math.sqrt(len(sample))
        assert (sample**power).mean() == pytest.approx(moment, abs=4 * error)


@pytest.mark.parametrize("rate", RATES)
def test_drops_per_beam_are_poisson_with_the_volume_of_the_cone(rate: float) -> None:
    beams, far = 20_000, 12.0
    drops = draw_drops(Rain(rate), np.full(beams, far), SENSOR, np.random.default_rng(2))
    counts = np.bincount(drops.beam, minlength=beams)

    half_angle = SENSOR.beam_divergence / 2
    cone = math.pi / 3 * (far * math.tan(half_angle)) ** 2 * far
    blind = math.pi / 3 * math.tan(half_angle) ** 2 * SENSOR.minimum_range**3
    expected = Rain(rate).drops_per_cubic_metre * (cone - blind)
    assert counts.mean() == pytest.approx(expected, abs=4 * math.sqrt(expected / beams))
    spread = math.sqrt((expected + 2 * expected**2) / beams)  # of a Poisson sample's variance
    assert counts.var() == pytest.approx(expected, abs=4 * spread)


def test_distances_follow_the_cross_section_of_the_cone() -> None:
    near, far = SENSOR.minimum_range, 15.0
    drops = draw_drops(Rain(25), np.full(50_000, far), SENSOR, np.random.default_rng(3))
    distance = np.sort(drops.range)
    assert len(distance) > 10_000
    cumulative = (distance**3 - near**3) / (far**3 - near**3)
    assert largest_deviation(distance, cumulative) < 1.95


def test_a_beam_that_ends_within_the_minimum_range_holds_no_drop() -> None:
    reach = np.full(10_000, SENSOR.minimum_range / 2)
    assert len(draw_drops(Rain(50), reach, SENSOR, np.random.default_rng(0)).beam) == 0


def test_a_drop_returns_with_the_fourth_power_of_distance_until_it_fills_the_beam() -> None:
    def power(distance: float) -> float:
        drops = Drops(np.zeros(1, np.int64), np.array([distance]), np.array([3.0]))
        return float(drop_reflectivity(drops, SENSOR)[0]) / distance**2

    filled = 3e-3 / SENSOR.beam_spread  # a drop of 3 mm is as wide as the beam at 2 m
    assert power(2 * filled) / power(4 * filled) == pytest.approx(2**4)
    assert power(filled / 4) / power(filled / 2) == pytest.approx(2**2)
    assert power(filled) == pytest.approx(DROP_REFLECTIVITY / filled**2)


def test_the_largest_drop_is_at_the_threshold_where_visibility_ends() -> None:
    horizon = farthest_visible_drop(SENSOR)
    drop = Drops(np.zeros(1, np.int64), np.array([horizon]), np.array([LARGEST_DROP]))
    power = drop_reflectivity(drop, SENSOR)[0] / horizon**2
    assert power == pytest.approx(SENSOR.detection_threshold)


@pytest.mark.parametrize("rate", RATES)
def test_open_beams_see_as_much_rain_as_the_integral_over_visible_drops(rate: float) -> None:
    """A visible drop is at least as wide as D(r) where its power is the threshold.

    The visible drops of a beam are a Poisson process, so the share of beams with none is
    exp(−their expected number), here a plain integral over distance.
    """
    rain, beams = Rain(rate), 40_000
    distance = np.linspace(SENSOR.minimum_range, SENSOR.maximum_range, 400_001)
    needed = SENSOR.detection_threshold * distance**2 * np.exp(2 * rain.extinction * distance)
    width = 1e3 * SENSOR.beam_spread * distance * np.sqrt(needed / DROP_REFLECTIVITY)
    width = np.clip(width, SMALLEST_DROP, LARGEST_DROP)
    density = np.exp(-rain.slope * width) - math.exp(-rain.slope * LARGEST_DROP)
    cross_section = math.pi / 4 * (SENSOR.beam_spread * distance) ** 2
    visible = np.trapezoid(INTERCEPT / rain.slope * density * cross_section, distance)
    share = 1 - math.exp(-visible)

    detected = rain_on_beams(open_air(beams), rain, SENSOR, np.random.default_rng(4))
    error = math.sqrt(share * (1 - share) / beams)
    assert detected.returned.mean() == pytest.approx(share, abs=4 * error)
    assert set(detected.label[detected.returned]) == {TrackClass.RAIN}


def test_surfaces_fade_with_the_way_there_and_back() -> None:
    rain, distance = Rain(50), 30.0
    clear = surfaces(distance, 0.8, 1000)
    detected = rain_on_beams(clear, rain, SENSOR, np.random.default_rng(5))
    kept = detected.label == TrackClass.CAR
    assert kept.sum() > 900
    assert np.allclose(detected.reflectivity[kept], 0.8 * math.exp(-2 * rain.extinction * distance))
    assert (detected.range[kept] == distance).all()


def test_the_strongest_return_of_each_beam_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    generator, rain = np.random.default_rng(6), Rain(25)
    clear = random_surfaces(300, generator)
    drops = draw_drops(rain, np.minimum(clear.range, 15), SENSOR, generator)
    # Ten times the drops, so that many beams hold several visible ones.
    drops = Drops(
        np.tile(drops.beam, 10),
        np.tile(drops.range, 10),
        rain.draw_diameters(10 * len(drops.beam), generator),
    )
    monkeypatch.setattr(rain_module, "draw_drops", lambda *_: drops)
    detected = rain_on_beams(clear, rain, SENSOR, generator)

    water = drop_reflectivity(drops, SENSOR)
    for beam in range(300):
        candidates = [
            (float(clear.reflectivity[beam]), float(clear.range[beam]), clear.label[beam])
        ]
        candidates += [
            (float(water[drop]), float(drops.range[drop]), np.int64(TrackClass.RAIN))
            for drop in np.flatnonzero(drops.beam == beam)
        ]
        received = [
            (
                reflectivity * math.exp(-2 * rain.extinction * distance) / distance**2,
                distance,
                label,
            )
            for reflectivity, distance, label in candidates
        ]
        power, distance, label = max(received, key=lambda candidate: candidate[0])
        if power < SENSOR.detection_threshold:
            assert not detected.returned[beam]
        else:
            assert detected.power[beam] == pytest.approx(power)
            assert detected.range[beam] == pytest.approx(distance)
            assert detected.label[beam] == label
    assert {"kept", "lost", "rain"} == {
        "lost" if not seen else "rain" if label == TrackClass.RAIN else "kept"
        for seen, label in zip(detected.returned, detected.label, strict=True)
    }


@settings(max_examples=25, deadline=None)
@given(rate=st.floats(0, 200), seed=st.integers(0, 2**32))
def test_a_beam_is_kept_weaker_or_ends_at_a_drop_in_front_or_is_lost(
    rate: float, seed: int
) -> None:
    generator = np.random.default_rng(seed)
    clear = random_surfaces(2000, generator)
    detected = rain_on_beams(clear, Rain(rate), SENSOR, generator)
    returned = detected.returned
    wet = returned & (detected.label == TrackClass.RAIN)
    kept = returned & ~wet

    assert (detected.power[returned] >= SENSOR.detection_threshold).all()
    assert (detected.range[kept] == clear.range[kept]).all()
    assert (detected.label[kept] == clear.label[kept]).all()
    assert (detected.reflectivity[kept] <= clear.reflectivity[kept]).all()
    assert (detected.range[wet] <= clear.range[wet]).all()
    assert (detected.range[wet] >= SENSOR.minimum_range).all()
    assert (detected.reflectivity[wet] <= DROP_REFLECTIVITY).all()
    assert (detected.label[~returned] == TrackClass.BACKGROUND).all()
    assert (detected.range[~returned] == SENSOR.maximum_range).all()


def test_clear_air_leaves_what_the_threshold_lets_through() -> None:
    clear = random_surfaces(5000, np.random.default_rng(7))
    detected = rain_on_beams(clear, Rain(0), SENSOR, np.random.default_rng(8))
    visible = clear.power >= SENSOR.detection_threshold
    assert 0 < visible.sum() < 5000
    assert (detected.returned == visible).all()
    assert (detected.reflectivity[visible] == clear.reflectivity[visible]).all()
    assert (detected.label[visible] == clear.label[visible]).all()


def test_more_rain_loses_more_surfaces() -> None:
    clear = random_surfaces(50_000, np.random.default_rng(9))
    kept = []
    for rate in (0, *RATES, 100):
        detected = rain_on_beams(clear, Rain(rate), SENSOR, np.random.default_rng(10))
        kept.append(np.count_nonzero(detected.returned & (detected.label != TrackClass.RAIN)))
    # Each step loses far more than the few hundred that chance could give back.
    assert (np.diff(kept) < -400).all(), kept


def test_a_seed_gives_the_same_rain_again() -> None:
    clear = random_surfaces(2000, np.random.default_rng(11))
    first, again, other = (
        rain_on_beams(clear, Rain(25), SENSOR, np.random.default_rng(seed)) for seed in (1, 1, 2)
    )
    assert (first.range == again.range).all()
    assert (first.reflectivity == again.reflectivity).all()
    assert (first.range != other.range).any()


def test_a_scan_without_beams_stays_empty() -> None:
    detected = rain_on_beams(open_air(0), Rain(25), SENSOR, np.random.default_rng(0))
    assert len(detected.range) == 0
