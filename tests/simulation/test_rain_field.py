"""Rain over the ground: even, and as measured in the facility."""

import math

import numpy as np
import pytest

from derain.errors import InputError
from derain.simulation.rain_field import RainField, SprinkledRain, UniformRain

# Nominal rate in mm/h, how far the facility's rain is even, and its span, in metres.
LEVELS = [(10.0, 80.0, 112.0), (25.0, 40.0, 56.0), (50.0, 20.0, 28.0)]


def test_even_rain_is_the_same_everywhere() -> None:
    x, y = np.meshgrid(np.linspace(-100, 100, 11), np.linspace(-50, 50, 7))
    assert (UniformRain(25).rate(x, y) == 25).all()
    assert UniformRain(25).rate(x, y).shape == x.shape
    assert UniformRain(25).heaviest == 25


@pytest.mark.parametrize(("nominal", "even", "span"), LEVELS)
def test_the_facility_rains_its_nominal_rate_on_the_lane_and_little_beyond(
    nominal: float, even: float, span: float
) -> None:
    rain = SprinkledRain(nominal)
    assert rain.span == span
    lane = rain.rate(*np.meshgrid(np.linspace(0, even, 401), np.linspace(-3, 3, 61)))
    assert lane.min() >= 0.8 * nominal
    assert lane.max() <= 1.4 * nominal
    assert lane.mean() == pytest.approx(nominal, rel=0.1)
    beyond = rain.rate(*np.meshgrid(np.linspace(even + 8, 200, 401), np.linspace(-50, 50, 61)))
    assert beyond.max() < 0.2 * nominal
    after_span = rain.rate(*np.meshgrid(np.linspace(span + 8, 200, 401), np.linspace(-50, 50, 61)))
    assert after_span.max() < 0.01 * nominal


def test_the_heaviest_rain_of_the_facility_falls_where_it_was_measured() -> None:
    x, y = np.meshgrid(np.linspace(0, 130, 521), np.linspace(-15, 15, 121), indexing="ij")
    rate = SprinkledRain(10).rate(x, y)
    inner = rate[1:-1, 1:-1]
    neighbours = [
        rate[1 + dx : rate.shape[0] - 1 + dx, 1 + dy : rate.shape[1] - 1 + dy]
        for dx in (-1, 0, 1)
        for dy in (-1, 0, 1)
        if dx or dy
    ]
    is_peak = (inner > np.max(neighbours, axis=0)) & (inner > 12)
    peaks = np.stack([x[1:-1, 1:-1][is_peak], y[1:-1, 1:-1][is_peak]], axis=1)
    assert peaks == pytest.approx(np.array([[25, -2], [58, 2]]), abs=0.5)


@pytest.mark.parametrize(("nominal", "even", "_"), LEVELS)
@pytest.mark.parametrize("wind", [(0.0, 0.0), (3.0, -40.0)])
def test_nowhere_does_it_rain_harder_than_the_heaviest_rate(
    nominal: float, even: float, _: float, wind: tuple[float, float]
) -> None:
    rain = SprinkledRain(nominal, wind)
    generator = np.random.default_rng(0)
    x = generator.uniform(-20, even + 20, 100_000) + wind[0]
    y = generator.uniform(-8, 8, 100_000) + wind[1]
    greatest = rain.rate(x, y).max()
    assert 0.97 * rain.heaviest < greatest <= rain.heaviest


def test_the_wind_carries_the_whole_field_along() -> None:
    x, y = np.meshgrid(np.linspace(-10, 60, 71), np.linspace(-10, 10, 21))
    still, windy = SprinkledRain(25), SprinkledRain(25, wind=(2.0, -3.0))
    assert np.allclose(windy.rate(x + 2, y - 3), still.rate(x, y))


@pytest.mark.parametrize("rain", [UniformRain, SprinkledRain])
@pytest.mark.parametrize("rate", [-1.0, 1e4, math.inf, math.nan])
def test_a_rate_that_is_no_rain_rate_is_refused(rain: type[RainField], rate: float) -> None:
    with pytest.raises(InputError, match="rain rate"):
        rain(rate)  # type: ignore[call-arg]


def test_sprinklers_that_are_off_or_an_impossible_wind_are_refused() -> None:
    with pytest.raises(InputError, match="rain rate"):
        SprinkledRain(0)
    with pytest.raises(InputError, match="wind"):
        SprinkledRain(10, wind=(math.inf, 0))
