"""The weather record against closed forms and numeric integration."""

import math

import numpy as np
import pytest

from derain.simulation.marshall_palmer import slope
from derain.simulation.weather import STRONGEST_WIND, Weather, draw_wind


@pytest.mark.parametrize(("rate", "visibility"), [(10.0, 2514), (25.0, 1412), (50.0, 912)])
def test_visibility_is_koschmieders_for_the_extinction_of_the_rain(
    rate: float, visibility: float
) -> None:
    # Extinction of 1.556, 2.771 and 4.288 per km.
    assert Weather.of(rate, rate, (0, 0)).visibility_m == pytest.approx(visibility, rel=1e-3)


@pytest.mark.parametrize("rate", [10.0, 50.0])
def test_half_of_the_water_is_in_drops_above_the_median_diameter(rate: float) -> None:
    diameter = np.linspace(0, 40, 400_001)
    water = np.cumsum(diameter**3 * np.exp(-float(slope(rate)) * diameter))
    median = diameter[np.searchsorted(water, water[-1] / 2)]
    assert Weather.of(rate, rate, (0, 0)).median_volume_diameter_mm == pytest.approx(median, 1e-3)


def test_clear_air_has_no_drops_and_no_end_to_its_visibility() -> None:
    clear = Weather.of(0.0, 0.0, (0, 0))
    assert clear.median_volume_diameter_mm == 0
    assert clear.drop_slope_per_mm == clear.visibility_m == math.inf


def test_the_wind_has_a_speed_and_a_direction_from_ahead_to_the_left() -> None:
    weather = Weather.of(10.0, 9.0, (0.0, 2.0))
    assert (weather.wind_speed_m_s, weather.wind_direction_deg) == (2.0, 90.0)
    winds = [draw_wind(np.random.default_rng(seed)) for seed in range(50)]
    assert len(set(winds)) == 50
    assert np.abs(winds).max() <= STRONGEST_WIND
