"""What is reported of beams through all that flies, against integrals and loops over beams."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from derain.scan import Floats
from derain.simulation.classes import TrackClass
from derain.simulation.flying.meeting import Encounters, covered_share, draw_haze, meet, uncrowded
from derain.simulation.flying.optics import Optics, Sizes, Slices
from derain.simulation.flying.precipitation import KINDS, Precipitation
from derain.simulation.rain import rain_on_beams
from derain.simulation.rain_field import UniformRain
from derain.simulation.sensor import Returns, Sensor

from ..surfaces import (
    assert_kept_weaker_or_ends_at_a_particle_or_lost,
    random_surfaces,
    surfaces,
)

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


def met(clear: Returns, weather: Precipitation, seed: int, sensor: Sensor = SENSOR) -> Returns:
    return meet(clear, sensor.beams(), weather, sensor, np.random.default_rng(seed))


def test_a_particle_covers_the_lens_of_both_discs() -> None:
    step = np.linspace(-0.5, 0.5, 1001)
    across, up = np.meshgrid(step, step)
    beam = across**2 + up**2 < 0.25
    for diameter in (0.3, 1.0, 4.0):
        for offset in (0.0, 0.2, 0.5, 1.6):
            particle = (across - offset) ** 2 + up**2 < diameter**2 / 4
            counted = np.count_nonzero(beam & particle) / np.count_nonzero(beam)
            share = covered_share(np.ones(1), np.array([diameter]), np.array([offset]))
            assert share == pytest.approx(counted, abs=4e-3)


def test_each_particle_stands_in_the_shadow_of_those_before_it() -> None:
    generator = np.random.default_rng(1)
    beam = generator.choice([row for row in range(30) if row % 5], 200)
    distance, covered = generator.uniform(1, 20, 200), generator.uniform(0, 1, 200)
    found = Encounters(beam, distance, covered, generator.random(200)).ordered()
    transmission, seen = found.transmission(30), found.reflectivity
    for beam in range(30):
        left = 1.0
        rows = np.flatnonzero(found.beam == beam)
        for row in rows[np.argsort(found.range[rows])]:
            assert seen[row] == pytest.approx(found.brightness[row] * found.covered[row] * left)
            left *= max(1 - found.covered[row], 1e-3) ** 2
        assert transmission[beam] == pytest.approx(left)


def test_clear_air_is_the_clear_air_of_rain_without_rain() -> None:
    clear = random_surfaces(len(BEAMS), np.random.default_rng(1))
    dry = rain_on_beams(clear, BEAMS, UniformRain(0), SENSOR, np.random.default_rng(2))
    assert_same(met(clear, Precipitation(), 3), dry)


@pytest.mark.parametrize("spill", [1.0, 2.0])
def test_both_returns_come_where_any_particle_is_before_a_dim_surface(spill) -> None:
    """Particles outshine the surface, which is the last: both unless the beam meets none."""
    snow = Precipitation(number=1500.0 / spill**2, spill=spill, reflectivity=1.0)
    beams, optics, sizes = SPARSE.beams(), Optics.of(snow, SPARSE), Sizes.gamma(1, 1, snow.largest)
    distance = np.linspace(SPARSE.minimum_range, 10, 20_001)
    width = optics.width(distance)
    area = np.pi / 4 * (width**2 + 2 * width * sizes.moment(1) + sizes.moment(2))
    share = -math.expm1(-snow.number * np.trapezoid(area, distance))
    detected = met(surfaces(len(beams), 10.0, 1e-12), snow, 4, SPARSE)
    assert 0.1 < share < 0.9
    error = math.sqrt(share * (1 - share) / len(beams))
    assert (np.bincount(detected.beam) == 2).mean() == pytest.approx(share, abs=4 * error)
    second = np.flatnonzero(np.diff(detected.beam, prepend=-1) == 0)
    # The strongest comes first. The surface is dimmer, and may be covered as a whole.
    rain = detected.label == TrackClass.RAIN
    assert rain[second - 1].all()
    assert (detected.label[second] == TrackClass.CAR).mean() > 0.9
    assert (detected.power[second] < detected.power[second - 1]).all()
    # A particle is returned from in front of its middle.
    assert (detected.range[rain] > SPARSE.minimum_range - 1e-3 * snow.largest / 2).all()


@settings(max_examples=30)
@given(
    kind=st.sampled_from(sorted(KINDS)),
    seed=st.integers(0, 2**32),
    returns=st.sampled_from(["strongest", "last", "dual"]),
)
def test_whatever_flies_each_beam_is_kept_weaker_or_ends_nearer_or_is_lost(
    kind, seed, returns
) -> None:
    generator = np.random.default_rng(seed)
    sensor, clear = replace(SENSOR, returns=returns), random_surfaces(len(BEAMS), generator)
    weather = KINDS[kind].draw(kind, generator)
    detected = met(clear, weather, seed, sensor)
    assert_kept_weaker_or_ends_at_a_particle_or_lost(clear, detected, sensor)
    assert kind != "none" or not (detected.label == TrackClass.RAIN).any()
    again = met(clear, weather, seed, sensor)
    assert_same(detected, again)


def test_surfaces_fade_with_what_is_too_small_to_be_seen() -> None:
    sensor = replace(SENSOR, detection_threshold=1e-5)
    fog = Precipitation(number=20_000.0, diameter=0.25, largest=0.3, reflectivity=1e-5)
    detected = met(surfaces(len(BEAMS), 30.0, 0.8), fog, 7, sensor)
    extinction = 20_000 * math.pi / 2 * Sizes.gamma(0.25, 1, 0.3).moment(2)
    assert (detected.label == TrackClass.CAR).all()
    assert detected.reflectivity == pytest.approx(0.8 * math.exp(-60 * extinction))


def test_weak_returns_scatter_more_than_strong_ones() -> None:
    sensor = replace(SPARSE, detection_threshold=1e-7, returns="strongest")
    clear = surfaces(sensor.columns * sensor.rows, 30.0, 0.0)
    exact, noisy = (
        met(clear, Precipitation(number=1000.0, jitter=jitter), 8, sensor) for jitter in (0.0, 0.2)
    )
    rain = exact.label == TrackClass.RAIN
    assert (rain == (noisy.label == TrackClass.RAIN)).all()
    inside = rain & (exact.range > 2) & (exact.range < 29)
    expected = 0.2 * np.sqrt(sensor.detection_threshold / exact.power[inside])
    shift = (noisy.range - exact.range)[inside]
    assert np.mean((shift / expected) ** 2) == pytest.approx(1, abs=0.2)
    assert np.ptp(expected) > 0.05


@pytest.mark.parametrize("crowding", [0.01, 1.0])
def test_no_more_particles_than_the_crowding_meet_an_open_beam(crowding) -> None:
    snow = Precipitation(number=1e5, diameter=3.0, crowding=crowding)
    optics, sizes = Optics.of(snow, SENSOR), Sizes.gamma(3.0, 1.0, snow.largest)
    few = uncrowded(snow, optics, sizes)
    assert few * Slices(1.0, optics, sizes).met.sum() == pytest.approx(crowding)
    assert uncrowded(replace(snow, number=few / 2), optics, sizes) == few / 2


def rain_places(weather: Precipitation, clear: Returns, seed: int) -> Floats:
    detected = met(clear, weather, seed)
    rain = detected.label == TrackClass.RAIN
    return BEAMS[detected.beam[rain]] * detected.range[rain, None]


def test_snow_drifts_near_the_ground_and_spray_flies_behind_the_car() -> None:
    snow = Precipitation(number=0.3, reach=40.0, drift=1000.0, drift_height=0.1)
    places = rain_places(snow, surfaces(len(BEAMS), 60.0, 0.0), 9)
    above = places[:, 2] + SENSOR.mounting_height
    assert len(places) > 50
    assert (np.abs(above - 0.2) < 0.25).mean() > 0.8

    clear = surfaces(len(BEAMS), 20.0, 0.0)
    car = (np.abs(BEAMS[:, 1]) < 0.1) & (np.abs(BEAMS[:, 2] + 0.1) < 0.05)
    seen = replace(clear, range=np.where(car, 12.0, 20.0), reflectivity=np.where(car, 0.3, 0.0))
    spray = Precipitation(plumes=3, plume_number=30_000.0, reach=40.0, plume_length=4.0)
    x, y, z = rain_places(spray, seen, 10).T
    assert len(x) > 20
    assert (np.abs(x - 12) < 4.5).all()
    assert (np.abs(y) < 2.0).all()
    assert (z < 1.6 - SENSOR.mounting_height + 0.1).all()


def test_a_share_of_the_beams_returns_haze_at_exponential_distances() -> None:
    sensor = Sensor(columns=500, rows=40, minimum_range=0.5)
    beams, drizzle = sensor.beams(), Precipitation(haze=0.2, haze_depth=3.0, haze_strength=50.0)
    walls, optics = surfaces(len(beams), 6.0, 0.5), Optics.of(drizzle, sensor)
    haze = draw_haze(walls, beams, drizzle, optics, np.random.default_rng(1))
    share = 0.2 * -math.expm1(-(6.0 - 0.5) / 3.0)
    error = math.sqrt(share * (1 - share) / len(beams))
    assert len(haze.beam) / len(beams) == pytest.approx(share, abs=4 * error)
    half = np.count_nonzero(haze.range < 0.5 + 3 * math.log(2)) / len(beams)
    assert half == pytest.approx(0.1, abs=4 * math.sqrt(0.09 / len(beams)))
    assert (haze.range < 6.0).all()
    assert (haze.power >= sensor.detection_threshold).all()
    assert (haze.power <= 50 * sensor.detection_threshold * (1 + 1e-6)).all()
    assert (haze.label == TrackClass.RAIN).all()

    # Patches keep the share and gather it.
    means, spreads = [], []
    for patches in (0.0, 3.0):
        patchy = replace(drizzle, haze_depth=0.1, haze_patches=patches)
        found = draw_haze(walls, beams, patchy, optics, np.random.default_rng(2))
        hit = np.bincount(found.beam, minlength=len(beams))
        shares = hit.reshape(4, 10, 50, 10).mean(axis=(1, 3))
        means.append(shares.mean())
        spreads.append(shares.std())
    assert means == pytest.approx([0.2, 0.2], abs=0.015)
    assert spreads[1] > 2 * spreads[0]


def test_no_beams_meet_nothing() -> None:
    none = surfaces(0, 1.0, 0.0)
    weather = Precipitation(number=100.0, haze=0.5, haze_patches=1.0, plumes=1)
    assert len(meet(none, np.empty((0, 3)), weather, SENSOR, np.random.default_rng(0)).beam) == 0
