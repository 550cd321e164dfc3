"""Rain over the ground: even, and as measured in the facility."""

import math

import numpy as np
import pytest

from derain.errors import InputError
from derain.simulation.rain_field import RainField, SprinkledRain, UniformRain


def test_even_rain_is_the_same_everywhere() -> None:
    x, y = np.meshgrid(np.linspace(-100, 100, 11), np.linspace(-50, 50, 7))
    assert np.array_equal(UniformRain(25).rate(x, y), np.full_like(x, 25))
    assert UniformRain(25).heaviest == 25


@pytest.mark.parametrize(
    ("nominal", "even", "span"), [(10.0, 80.0, 112.0), (25.0, 40.0, 56.0), (50.0, 20.0, 28.0)]
)
def test_the_facility_rains_its_nominal_rate_on_the_lane_and_little_beyond(
    nominal: float, even: float, span: float
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
