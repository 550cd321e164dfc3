"""Rain over the ground, even and as measured in the facility, its drops, and the weather."""

import math

import numpy as np
import pytest

from derain.errors import InputError
from derain.simulation.radar import volume_reflectivity
from derain.simulation.rain import drops_per_cubic_metre
from derain.simulation.rain_field import (
    INTERCEPT,
    SprinkledRain,
    UniformRain,
    extinction,
    slope,
    weather_record,
)
from derain.simulation.scene import STRONGEST_WIND, draw_wind


@pytest.mark.parametrize(
    ("rate", "steepness", "density", "share_per_metre", "visibility"),
    [
        (10.0, 2.5280, 894.0, 1.556e-3, 2514),
        (25.0, 2.0855, 1352.1, 2.771e-3, 1412),
        (50.0, 1.8030, 1801.1, 4.288e-3, 912),
    ],
)
def test_rain_has_marshall_and_palmers_drops_and_takes_light_and_sight_by_their_cross_sections(
    rate, steepness, density, share_per_metre, visibility
) -> None:
    assert slope(rate) == pytest.approx(steepness, abs=5e-5)
    assert drops_per_cubic_metre(rate) == pytest.approx(density, abs=0.05)
    assert extinction(rate) == pytest.approx(share_per_metre, abs=5e-7)
    diameter = np.linspace(0, 40, 400_001)
    number = INTERCEPT * np.exp(-steepness * diameter)
    cross_section = 1e-6 * np.pi / 4 * diameter**2  # m²
    area = np.trapezoid(cross_section * number, diameter)
    assert extinction(rate) == pytest.approx(2 * area, rel=1e-3)
    assert volume_reflectivity(np.array(rate)) == pytest.approx(0.9 * area, rel=1e-3)
    weather = weather_record(rate, 9.0, (0.0, 2.0))
    water = np.cumsum(diameter**3 * number)
    median = diameter[np.searchsorted(water, water[-1] / 2)]
    assert weather["median_volume_diameter_mm"] == pytest.approx(median, 1e-3)
    assert weather["visibility_m"] == pytest.approx(visibility, rel=1e-3)  # Koschmieder's
    assert (weather["wind_speed_m_s"], weather["wind_direction_deg"]) == (2.0, 90.0)
    assert (UniformRain(rate).rate(diameter, diameter) == UniformRain(rate).heaviest).all()


def test_clear_air_has_no_drops_and_no_end_to_its_visibility_and_winds_are_weak() -> None:
    clear = weather_record(0.0, 0.0, (0, 0))
    assert clear["median_volume_diameter_mm"] == 0
    assert clear["drop_slope_per_mm"] == clear["visibility_m"] == math.inf
    winds = [draw_wind(np.random.default_rng(seed)) for seed in range(50)]
    assert 0.9 * STRONGEST_WIND < np.abs(winds).max() <= STRONGEST_WIND


@pytest.mark.parametrize(
    ("nominal", "even", "span"), [(10.0, 80.0, 112.0), (25.0, 40.0, 56.0), (50.0, 20.0, 28.0)]
)
def test_the_facility_rains_its_nominal_rate_on_the_lane_and_little_beyond(
    nominal, even, span
) -> None:
    rain = SprinkledRain(nominal)
    assert rain.span == span
    lane = rain.rate(*np.meshgrid(np.linspace(0, even, 401), np.linspace(-3, 3, 61)))
    assert lane.min() >= 0.8 * nominal
    assert lane.max() <= 1.4 * nominal
    assert lane.mean() == pytest.approx(nominal, rel=0.1)
    for begin, most in ((even + 8, 0.2), (span + 8, 0.01)):
        beyond = rain.rate(*np.meshgrid(np.linspace(begin, 200, 401), np.linspace(-50, 50, 61)))
        assert beyond.max() < most * nominal
    # The wind carries the whole field along, whose heaviest rate is exceeded nowhere.
    windy = SprinkledRain(nominal, (3.0, -40.0))
    x = np.random.default_rng(0).uniform(-20, even + 20, 50_000)
    y = np.random.default_rng(1).uniform(-8, 8, 50_000)
    assert np.allclose(windy.rate(x + 3, y - 40), rain.rate(x, y))
    assert 0.97 * windy.heaviest < rain.rate(x, y).max() <= windy.heaviest
    assert windy.heaviest == pytest.approx(rain.heaviest)


def test_the_heaviest_rain_of_the_facility_falls_where_it_was_measured() -> None:
    rain, x = SprinkledRain(10), np.linspace(0, 130, 521)
    for place in ((25, -2), (58, 2)):
        near = np.array(place) + np.mgrid[-8:8:65j, -8:8:65j].reshape(2, -1).T
        peak = near[rain.rate(*near.T).argmax()]
        assert peak == pytest.approx(np.array(place), abs=0.5)
        assert rain.rate(*peak) > 12
        assert rain.rate(*peak) > 0.9 * rain.rate(x, np.full_like(x, place[1])).max()


@pytest.mark.parametrize(
    ("rain", "given", "named"),
    [
        *((UniformRain, (rate,), "rain: .*2,000") for rate in (-1.0, 1e4, math.inf, math.nan)),
        *((SprinkledRain, (rate,), "rain: ") for rate in (0.0, 1e4, math.nan)),
        (SprinkledRain, (10, (math.inf, 0)), "wind"),
    ],
)
def test_impossible_rain_or_wind_is_refused(rain, given, named) -> None:
    with pytest.raises(InputError, match=named):
        rain(*given)
