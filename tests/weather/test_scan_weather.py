"""The weather of scans: shares by sector and range, pooled, and worse the more it rains."""

import numpy as np
import pytest

from derain.errors import InputError
from derain.evaluation.hard_cases import hard_cases, scene
from derain.scan import Scan
from derain.simulation.classes import TrackClass
from derain.simulation.rain_field import UniformRain
from derain.simulation.recorded import rain_on_scan
from derain.simulation.sensor import load_sensor
from derain.weather.rays import BIN, RAY_SECTORS
from derain.weather.scan_weather import RANGE_BANDS, ScanWeather, dry_reach
from derain.weather.visibility import NOT_KNOWN

RATES = (0.0, 5.0, 20.0, 80.0)


def street() -> Scan:
    """What a sensor of 48 rows sees of a road between two walls in clear air."""
    azimuth, inclination = np.meshgrid(
        np.radians(np.arange(-180, 180, 0.75) + 0.3), np.radians(np.linspace(-20, 6, 48))
    )
    across = np.cos(inclination)
    directions = np.stack(
        [across * np.cos(azimuth), across * np.sin(azimuth), np.sin(inclination)], axis=-1
    ).reshape(-1, 3)
    with np.errstate(divide="ignore"):
        wall = 9 / np.abs(directions[:, 1])
        road = np.where(directions[:, 2] < 0, -1.8 / directions[:, 2], np.inf)
    reach = np.minimum(wall, road)
    seen = reach < 90
    intensity = np.random.default_rng(0).uniform(20, 90, (int(seen.sum()), 1))
    return Scan.of(np.hstack([directions[seen] * reach[seen, None], intensity]))


def test_the_heavier_the_rain_the_worse_the_weather() -> None:
    clean, sensor = street(), load_sensor("spinning_64_far")
    scans = [
        rain_on_scan(clean, UniformRain(rate), sensor, np.random.default_rng(1)) for rate in RATES
    ]
    rained = [(scan, scan.label == TrackClass.RAIN) for scan in scans]
    weathers = [ScanWeather.of(scan, rain) for scan, rain in rained]
    assert weathers[0].visibility.metres is None
    reach = [weather.visibility.at_least for weather in weathers]
    assert reach == sorted(reach, reverse=True)
    assert len(set(reach)) == len(RATES)
    shares = [weather.met_rain / weather.rays for weather in weathers]
    assert shares == sorted(shares)
    assert shares[0] == 0
    # It rains alike on all sides, and is seen near by.
    by_sector = np.stack([weather.shares_by_sector for weather in weathers])
    assert (np.diff(by_sector, axis=0) > 0).all()
    by_range = weathers[-1].shares_by_range
    assert by_range[0] > by_range[2] > by_range[3]


def test_shares_are_counts_of_rays() -> None:
    points = np.array(
        [[3, 0, 0], [3, 0.1, 0], [7, 0, 0.2], [0, 15, 0], [0, -50, 0], [90, 0, 1]], np.float32
    )
    weather = ScanWeather.of(points, np.array([True, False, True, False, True, False]))
    assert (weather.rays, weather.met_rain) == (6, 3)
    shares = np.full((RAY_SECTORS, len(RANGE_BANDS)), np.nan)
    shares[0, 0], shares[0, 1], shares[0, 5] = 0.5, 1, 0
    shares[3, 2], shares[9, 4] = 0, 1
    np.testing.assert_array_equal(weather.shares, shares)
    np.testing.assert_array_equal(weather.shares_by_sector[[0, 3, 9]], [0.5, 0, 1])
    np.testing.assert_array_equal(weather.shares_by_range, [0.5, 1, 0, np.nan, 1, 0])


def test_scans_add_up() -> None:
    first, second = scene(1000, seed=1), scene(1500, seed=2)
    parts = [ScanWeather.of(points, points[:, 2] > 0) for points in (first, second)]
    pooled = ScanWeather.none() + parts[0] + parts[1]
    assert pooled.rays == parts[0].rays + parts[1].rays
    assert pooled.met_rain == parts[0].met_rain + parts[1].met_rain
    lowest, highest = sorted(part.visibility.at_least for part in parts)
    assert lowest <= pooled.visibility.at_least <= highest
    assert pooled.visibility_in(*range(RAY_SECTORS)) == pooled.visibility
    # The scene lies between -90 and 90 degrees: what a sensor does not look at is not known.
    assert np.isnan(pooled.shares_by_sector[5:8]).all()
    assert pooled.visibility_in(0).known
    assert not pooled.visibility_in(5, 6, 7).known
    for sectors in ((12,), (-1, 0), ()):
        with pytest.raises(InputError, match="Give numbers from 0 to 11"):
            pooled.visibility_in(*sectors)


def test_reach_is_that_of_all_rays_and_does_not_depend_on_what_is_called_rain() -> None:
    scan = street()
    drops = scan.range < np.quantile(scan.range, 0.3)
    for rain in (np.zeros(len(scan), bool), drops):
        weather = ScanWeather.of(scan, rain)
        assert weather.reach.metres == pytest.approx(np.quantile(scan.range, 0.99), abs=BIN)
        assert weather.range_of(0.95).metres == pytest.approx(
            np.quantile(scan.range, 0.95), abs=BIN
        )


def test_the_dry_reach_is_what_nineteen_scans_of_twenty_reach() -> None:
    def reaching(metres: int) -> ScanWeather:
        ends = np.zeros_like(ScanWeather.none().ends)
        ends[0, 0, int(metres / BIN)] = 10_000
        return ScanWeather(ends)

    scans = [reaching(metres) for metres in (10, *range(50, 69))]
    dry = dry_reach([*scans, ScanWeather.none()])
    assert dry.metres == pytest.approx(50, abs=BIN)
    assert dry_reach([ScanWeather.none()]) == NOT_KNOWN


def test_every_hard_case_has_a_defined_weather() -> None:
    for name, scan in hard_cases(500):
        for rain in (np.zeros(len(scan), bool), np.ones(len(scan), bool)):
            weather = ScanWeather.of(scan, rain)
            assert (weather.rays > 0) == scan.valid.any(), name
            assert weather.rays <= scan.valid.sum(), name
            shares = weather.shares[~np.isnan(weather.shares)]
            assert ((shares >= 0) & (shares <= 1)).all(), name
            assert weather.rays == 0 or weather.met_rain == rain.any() * weather.rays, name
            assert weather.visibility.at_least >= 0, name
            assert weather.visibility.known or weather.visibility.at_least == 0, name
            assert weather.reach.known or weather.rays < 100, name


def test_a_mask_has_to_fit() -> None:
    for rain in (np.zeros(9, bool), np.zeros((10, 1), bool), np.zeros(10, int)):
        with pytest.raises(InputError, match=r"for 10 points\. Give True or False"):
            ScanWeather.of(scene(10), rain)
