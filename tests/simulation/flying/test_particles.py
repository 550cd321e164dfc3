"""Particles: their sizes, what is seen of them, and the beams that meet them."""

import math
from dataclasses import replace

import numpy as np
import pytest

from derain.scan import Floats
from derain.simulation.flying import particles as particles_module
from derain.simulation.flying.optics import Optics, Sizes, Slices
from derain.simulation.flying.particles import OpenBeams, Particles, Stretch, draw_particles
from derain.simulation.flying.precipitation import SMALLEST, Precipitation
from derain.simulation.sensor import Sensor

NARROW = Sensor(aperture=0.005)


@pytest.mark.parametrize(("mean", "shape", "largest"), [(1, 1, 6), (3, 4, 20), (0.3, 1, 2)])
def test_moments_are_those_of_the_cut_gamma_distribution(mean, shape, largest) -> None:
    sizes = Sizes.gamma(mean, shape, largest)
    diameter = np.linspace(SMALLEST, largest, 200_001)
    density = diameter ** (shape - 1) * np.exp(-shape * diameter / mean)
    density /= np.trapezoid(density, diameter)
    for power in (0, 1, 2, 3):
        moment = np.trapezoid(density * (1e-3 * diameter) ** power, diameter)
        assert sizes.moment(power) == pytest.approx(moment, rel=1e-3)


@pytest.mark.parametrize("mean", [1e-3, 1e4])
def test_a_mean_far_outside_the_cut_leaves_finite_shares(mean) -> None:
    assert Sizes.gamma(mean, 5, 20).share.sum() == pytest.approx(1)


@pytest.mark.parametrize("reach", [0.0, 5.0, 80.0])
@pytest.mark.parametrize("spill", [1.0, 3.0])
def test_the_smallest_visible_particle_is_at_the_threshold(reach, spill) -> None:
    optics = Optics.of(Precipitation(reach=reach, spill=spill, diameter=2.0), NARROW)
    distance = np.array([1.0, 4.0, 15.0])
    smallest = optics.smallest_visible(distance)
    width = spill * (0.005 + NARROW.beam_spread * distance)
    power = optics.brightness * (smallest / width) ** 2 / distance**2
    assert power == pytest.approx(NARROW.detection_threshold)
    if reach:
        assert optics.smallest_visible(np.array([reach])) == pytest.approx(2e-3)


def test_no_size_is_seen_beyond_the_cut_off_or_of_what_is_too_dark_for_its_distance() -> None:
    dark = Precipitation(reflectivity=0.01)
    too_far = np.sqrt(0.01 / NARROW.detection_threshold)
    for precipitation, farthest in ((Precipitation(cut_off=7.0), 7.0), (dark, too_far)):
        optics = Optics.of(precipitation, NARROW)
        seen = np.isfinite(optics.smallest_visible(farthest * np.array([0.999, 1.001])))
        assert seen.tolist() == [True, False]


def test_slices_count_what_would_be_seen_in_the_middle_of_a_beam() -> None:
    sensor = replace(NARROW, aperture=0.0, maximum_range=60.0)
    optics, sizes = Optics.of(Precipitation(), sensor), Sizes.gamma(2.0, 1.0, 10.0)
    distance = np.linspace(1, 60, 20_001)
    width = optics.width(distance)[:, None]
    visible = sizes.diameter >= optics.smallest_visible(distance)[:, None]
    area = visible * np.pi / 4 * (width + sizes.diameter) ** 2
    exact = np.trapezoid((area * sizes.share).sum(axis=1), distance)
    # The slices are as wide as at their far end.
    assert exact < Slices(1.0, optics, sizes).met.sum() < 1.6 * exact


# It sees everything within 12 m.
SENSOR = Sensor(maximum_range=12.0, detection_threshold=1e-12)
OPTICS = Optics.of(Precipitation(), SENSOR)
SIZES = Sizes.gamma(2.0, 1.0, 10.0)

# Beams that are far apart: up to 12 m the nearest are half a metre from each other.
APART = Sensor(columns=100, rows=20, azimuth=(-180, 180), inclination=(-40, 40)).beams()

# Beams of which each overlaps several others.
TOGETHER = Sensor(columns=30, rows=20, azimuth=(-0.5, 0.5), inclination=(-0.3, 0.3)).beams()


def open_beams(directions: Floats, far: Floats | float = 12.0) -> OpenBeams:
    near = np.full(len(directions), SENSOR.minimum_range)
    return OpenBeams(directions, Stretch(near, np.broadcast_to(far, near.shape)), OPTICS)


def tube(far: float, diameter: Floats) -> Floats:
    """Volume in which a beam meets particles of some diameters, cubic metres."""
    distance = np.linspace(SENSOR.minimum_range, far, 2001)
    area = np.pi / 4 * (OPTICS.width(distance) + diameter[:, None]) ** 2
    return np.trapezoid(area, distance, axis=1)


def mean_tube(far: float) -> float:
    return float((SIZES.share * tube(far, SIZES.diameter)).sum())


def test_meetings_are_those_found_by_looking_at_every_beam(monkeypatch) -> None:
    monkeypatch.setattr(particles_module, "PAIRS_AT_ONCE", 50)
    generator = np.random.default_rng(1)
    far = generator.uniform(0.3, 30, 80)
    place = TOGETHER[generator.integers(len(TOGETHER), size=80)] * far[:, None]
    place += generator.normal(0, 0.01, place.shape)
    drawn = Particles(place, generator.choice([0.001, 0.01, 0.1, 2.0], 80))

    beams = open_beams(TOGETHER)
    meetings = beams.meetings(drawn)
    chord = np.linalg.norm(place[:, None] / drawn.range[:, None, None] - TOGETHER, axis=2)
    offset = chord * drawn.range[:, None]
    met = np.argwhere(offset < (OPTICS.width(drawn.range) + drawn.diameter)[:, None] / 2)
    assert len(met) > 1200  # some meet all of the beams, some meet few
    found = np.stack([meetings.particle, meetings.beam], axis=1)
    assert sorted(map(tuple, found)) == sorted(map(tuple, met))
    assert (np.diff(meetings.particle) >= 0).all()
    assert np.allclose(meetings.offset, offset[meetings.particle, meetings.beam], atol=1e-9)
    _, nearest = beams.nearest(place, 1)
    assert (nearest[:, 0] == offset.argmin(axis=1)).all()


def test_distances_and_sizes_follow_the_volume_of_each() -> None:
    number, beams = 100.0 / mean_tube(12.0), open_beams(APART)
    particles, _ = draw_particles(number, SIZES, beams.stretch, beams, np.random.default_rng(2))
    volume = SIZES.share * tube(12.0, SIZES.diameter)
    large = SIZES.diameter >= 4e-3
    for found, share in (
        (particles.range < 6, mean_tube(6.0) / volume.sum()),
        (particles.diameter >= 4e-3, volume[large].sum() / volume.sum()),
    ):
        error = math.sqrt(share * (1 - share) / len(found))
        assert found.mean() == pytest.approx(share, abs=4 * error)


@pytest.mark.parametrize("shadow", [False, True])
def test_beams_that_overlap_share_the_particles_of_the_space_that_they_fill(shadow) -> None:
    """Places in a box around the beams are tried one by one; every third beam may end early."""
    far = np.where(np.arange(len(TOGETHER)) % 3 == 0, 12.0, 4.0 if shadow else 12.0)
    beams = open_beams(TOGETHER, far)
    generator = np.random.default_rng(3)
    low, high = np.array([0.9, -0.15, -0.1]), np.array([12.1, 0.15, 0.1])
    number, box = 3e4, float(np.prod(high - low))
    place = generator.uniform(low, high, (generator.poisson(number * box), 3))
    tried = Particles(place, generator.choice(SIZES.diameter, len(place), p=SIZES.share))
    met = beams.meetings(tried)
    at = tried.range[met.particle]
    met = met.take((at >= 1) & (at <= far[met.beam]))
    particles, meetings = draw_particles(number, SIZES, beams.stretch, beams, generator)

    expected = len(np.unique(met.particle))
    assert expected > 2000
    assert len(particles.diameter) == pytest.approx(expected, abs=4 * math.sqrt(2 * expected))
    ratio = len(met.beam) / expected
    assert ratio > 2
    assert len(meetings.beam) / len(particles.diameter) == pytest.approx(ratio, rel=0.1)


def test_beams_that_end_at_once_meet_nothing() -> None:
    beams = open_beams(APART, 0.5)
    particles, meetings = draw_particles(1e6, SIZES, beams.stretch, beams, np.random.default_rng(6))
    assert len(particles.diameter) == len(meetings.beam) == 0
