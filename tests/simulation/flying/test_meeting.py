"""What is reported of beams through all that flies."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from derain.simulation.arrays import Floats
from derain.simulation.classes import TrackClass
from derain.simulation.flying.kinds import KINDS
from derain.simulation.flying.meeting import meet, uncrowded
from derain.simulation.flying.precipitation import Precipitation
from derain.simulation.flying.sizes import Optics, Sizes, Slices
from derain.simulation.rain import rain_on_beams
from derain.simulation.rain_field import UniformRain
from derain.simulation.sensor import Returns, Sensor

from ..surfaces import random_surfaces, surfaces

SENSOR = Sensor(columns=60, rows=30)
BEAMS = SENSOR.beams()

# Up to 10 m its beams are farther from each other than particles are wide.
SPARSE = Sensor(
    columns=100,
    rows=40,
    azimuth=(-180, 180),
    inclination=(-40, 40),
    detection_threshold=1e-16,
    returns="dual",
)


def assert_same(first: Returns, second: Returns) -> None:
    for name in ("range", "reflectivity", "label", "beam"):
        assert (getattr(first, name) == getattr(second, name)).all(), name


def test_clear_air_is_the_clear_air_of_rain_without_rain() -> None:
    clear = random_surfaces(len(BEAMS), np.random.default_rng(1))
    dry = rain_on_beams(clear, BEAMS, UniformRain(0), SENSOR, np.random.default_rng(2))
    assert_same(meet(clear, BEAMS, Precipitation(), SENSOR, np.random.default_rng(3)), dry)


def in_lone_beams(precipitation: Precipitation, far: float) -> float:
    """Particles that one of the sparse beams meets within a distance, on average."""
    optics = Optics.of(precipitation, SPARSE)
    sizes = Sizes.gamma(precipitation.diameter, precipitation.shape, precipitation.largest)
    distance = np.linspace(SPARSE.minimum_range, far, 20_001)
    width = optics.width(distance)
    area = np.pi / 4 * (width**2 + 2 * width * sizes.moment(1) + sizes.moment(2))
    return float(precipitation.number * np.trapezoid(area, distance))


@pytest.mark.parametrize("spill", [1.0, 2.0])
def test_both_returns_come_where_any_particle_is_before_a_dim_surface(spill: float) -> None:
    """Particles outshine the surface, which is the last: both unless the beam meets none."""
    number = 1500.0 / spill**2
    beams, snow = SPARSE.beams(), Precipitation(number=number, spill=spill, reflectivity=1.0)
    clear = surfaces(len(beams), 10.0, 1e-12)
    detected = meet(clear, beams, snow, SPARSE, np.random.default_rng(4))
    rows = np.bincount(detected.beam)
    share = -math.expm1(-in_lone_beams(snow, 10.0))
    assert 0.1 < share < 0.9
    error = math.sqrt(share * (1 - share) / len(beams))
    assert (rows == 2).mean() == pytest.approx(share, abs=4 * error)
    first = np.flatnonzero(np.diff(detected.beam, prepend=-1))
    second = np.setdiff1d(np.arange(len(detected.beam)), first)
    # The strongest comes first. The surface is dimmer, and may be covered as a whole.
    assert (detected.label[second - 1] == TrackClass.RAIN).all()
    assert (detected.label[second] == TrackClass.CAR).mean() > 0.9
    assert (detected.power[second] < detected.power[second - 1]).all()


def test_both_returns_of_a_ray_can_be_particles() -> None:
    beams = SPARSE.beams()
    sky = replace(surfaces(len(beams), SPARSE.maximum_range, 0.0), label=np.zeros(len(beams), int))
    snow = Precipitation(number=1500.0, cut_off=10.0)
    detected = meet(sky, beams, snow, SPARSE, np.random.default_rng(5))
    rain = np.bincount(detected.beam[detected.label == TrackClass.RAIN], minlength=len(beams))
    mean = in_lone_beams(snow, 10.0)
    none, one = math.exp(-mean), mean * math.exp(-mean)
    error = 4 / math.sqrt(4 * len(beams))
    assert (rain == 0).mean() == pytest.approx(none, abs=error)
    # Of two and more, one is both the strongest and the last about half the time or less.
    assert one < (rain == 1).mean() < 1 - none
    assert (rain == 2).mean() > (1 - none - one) / 4


@pytest.mark.parametrize("reflectivity", [1e-6, 0.5])
def test_the_strongest_is_the_surface_or_the_particle_by_power(reflectivity: float) -> None:
    beams, snow = SPARSE.beams(), Precipitation(number=1500.0, reflectivity=0.3)
    clear = surfaces(len(beams), 10.0, reflectivity)
    both = meet(clear, beams, snow, SPARSE, np.random.default_rng(6))
    one = replace(SPARSE, returns="strongest")
    strongest = meet(clear, beams, snow, one, np.random.default_rng(6))
    first = np.flatnonzero(np.diff(both.beam, prepend=-1))
    assert (both.power[first] == strongest.power).all()
    rain = (strongest.label == TrackClass.RAIN).mean()
    assert rain > 0.25 if reflectivity < 1e-4 else 0.01 < rain < 0.25
    last = meet(clear, beams, snow, replace(SPARSE, returns="last"), np.random.default_rng(6))
    assert (last.label == TrackClass.CAR).mean() > 0.98


@settings(max_examples=30, deadline=None)
@given(
    kind=st.sampled_from(sorted(KINDS)),
    seed=st.integers(0, 2**32),
    returns=st.sampled_from(["strongest", "last", "dual"]),
)
def test_whatever_flies_each_beam_is_kept_weaker_or_ends_nearer_or_is_lost(
    kind: str, seed: int, returns: str
) -> None:
    generator = np.random.default_rng(seed)
    sensor, clear = replace(SENSOR, returns=returns), random_surfaces(len(BEAMS), generator)
    weather = KINDS[kind].draw(kind, generator)
    detected = meet(clear, BEAMS, weather, sensor, np.random.default_rng(seed))
    beam, returned = detected.beam, detected.returned
    rain = detected.label == TrackClass.RAIN
    kept = returned & ~rain

    assert set(beam) == set(range(len(BEAMS)))
    assert (np.diff(beam) >= 0).all()
    assert np.bincount(beam).max() <= (2 if returns == "dual" else 1)
    assert (detected.power[returned] >= sensor.detection_threshold * (1 - 1e-9)).all()
    assert (detected.reflectivity <= 1).all()
    assert returned[rain].all()
    assert (detected.range[rain] <= np.minimum(clear.range[beam[rain]], 120)).all()
    assert (detected.range[rain] >= sensor.minimum_range).all()
    assert (detected.range[kept] == clear.range[beam[kept]]).all()
    assert (detected.label[kept] == clear.label[beam[kept]]).all()
    assert (detected.reflectivity[kept] <= clear.reflectivity[beam[kept]]).all()
    assert (detected.range[~returned] == sensor.maximum_range).all()
    assert not rain.any() or kind != "none"
    again = meet(clear, BEAMS, weather, sensor, np.random.default_rng(seed))
    assert_same(detected, again)


def test_surfaces_fade_with_what_is_too_small_to_be_seen() -> None:
    sensor = replace(SENSOR, detection_threshold=1e-5)
    fog = Precipitation(number=20_000.0, diameter=0.25, largest=0.3, reflectivity=1e-5)
    detected = meet(surfaces(len(BEAMS), 30.0, 0.8), BEAMS, fog, sensor, np.random.default_rng(7))
    extinction = 20_000 * Sizes.gamma(0.25, 1, 0.3).extinction
    assert (detected.label == TrackClass.CAR).all()
    assert detected.reflectivity == pytest.approx(0.8 * math.exp(-60 * extinction))


def test_weak_returns_scatter_more_than_strong_ones() -> None:
    beams = SPARSE.beams()
    sensor = replace(SPARSE, detection_threshold=1e-7, returns="strongest")
    clear = surfaces(len(beams), 30.0, 0.0)

    def found(jitter: float) -> Returns:
        snow = Precipitation(number=1000.0, jitter=jitter)
        return meet(clear, beams, snow, sensor, np.random.default_rng(8))

    exact, noisy = found(0.0), found(0.2)
    rain = exact.label == TrackClass.RAIN
    assert (rain == (noisy.label == TrackClass.RAIN)).all()
    shift = np.abs(noisy.range - exact.range)[rain]
    ratio = sensor.detection_threshold / exact.power[rain]
    weak = ratio > np.median(ratio)
    expected = 0.2 * np.sqrt(ratio)
    assert np.std(shift[weak]) > 2 * np.std(shift[~weak])
    inside = (exact.range[rain] > 2) & (exact.range[rain] < 29)
    assert np.mean((shift / expected)[inside] ** 2) == pytest.approx(1, abs=0.2)


@pytest.mark.parametrize("crowding", [0.01, 0.1, 1.0])
def test_no_more_particles_than_the_crowding_meet_an_open_beam(crowding: float) -> None:
    snow = Precipitation(number=1e5, diameter=3.0, crowding=crowding)
    few = uncrowded(snow, SENSOR)
    sizes = Sizes.gamma(3.0, 1.0, snow.largest)
    met = few * Slices(SENSOR.minimum_range, Optics.of(snow, SENSOR), sizes).met.sum()
    assert met == pytest.approx(crowding)
    assert uncrowded(replace(snow, number=few / 2), SENSOR) == few / 2


def rain_places(weather: Precipitation, clear: Returns, seed: int) -> Floats:
    detected = meet(clear, BEAMS, weather, SENSOR, np.random.default_rng(seed))
    rain = detected.label == TrackClass.RAIN
    return BEAMS[detected.beam[rain]] * detected.range[rain, None]


def test_drifting_snow_lies_near_the_ground() -> None:
    snow = Precipitation(number=0.3, reach=40.0, drift=1000.0, drift_height=0.1)
    places = rain_places(snow, surfaces(len(BEAMS), 60.0, 0.0), 9)
    above = places[:, 2] + SENSOR.mounting_height
    assert len(places) > 50
    assert (np.abs(above - 0.2) < 0.25).mean() > 0.8


def test_spray_flies_behind_the_car() -> None:
    clear = surfaces(len(BEAMS), 20.0, 0.0)
    car = (np.abs(BEAMS[:, 1]) < 0.1) & (np.abs(BEAMS[:, 2] + 0.1) < 0.05)
    seen = replace(clear, range=np.where(car, 12.0, 20.0), reflectivity=np.where(car, 0.3, 0.0))
    spray = Precipitation(plumes=3, plume_number=30_000.0, reach=40.0, plume_length=4.0)
    places = rain_places(spray, seen, 10)
    assert len(places) > 20
    x, y, z = places.T
    assert (np.abs(x - 12) < 4.5).all()
    assert (np.abs(y) < 2.0).all()
    assert (z < 1.6 - SENSOR.mounting_height + 0.1).all()


def test_no_beams_meet_nothing() -> None:
    none = surfaces(0, 1.0, 0.0)
    weather = Precipitation(number=100.0, haze=0.5, haze_patches=1.0, plumes=1)
    assert len(meet(none, np.empty((0, 3)), weather, SENSOR, np.random.default_rng(0)).beam) == 0
