"""Particles in beams against volumes."""

import math
from dataclasses import replace

import numpy as np
import pytest

from derain.simulation.arrays import Floats
from derain.simulation.flying.particles import OpenBeams, Stretch, draw_particles
from derain.simulation.flying.precipitation import Precipitation
from derain.simulation.flying.sizes import Optics, Sizes, Slices
from derain.simulation.sensor import Sensor

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


def tube(far: float) -> float:
    """Volume in which a beam meets a particle, averaged over the sizes, cubic metres."""
    distance = np.linspace(SENSOR.minimum_range, far, 20_001)
    width = OPTICS.width(distance)
    area = np.pi / 4 * (width**2 + 2 * width * SIZES.moment(1) + SIZES.moment(2))
    return float(np.trapezoid(area, distance))


def test_particles_of_a_lone_beam_are_poisson_with_the_volume_around_it() -> None:
    number = 2.0 / tube(12.0)
    counts = []
    generator = np.random.default_rng(1)
    for _ in range(5):
        beams = open_beams(APART)
        _, meetings = draw_particles(number, SIZES, beams.stretch, beams, generator)
        counts.append(np.bincount(meetings.beam, minlength=len(APART)))
    count = np.concatenate(counts)
    assert count.mean() == pytest.approx(2, abs=4 * math.sqrt(2 / len(count)))
    assert count.var() == pytest.approx(2, abs=4 * math.sqrt((2 + 2 * 2**2) / len(count)))


def test_distances_and_sizes_follow_the_volume_of_each() -> None:
    beams = open_beams(APART)
    particles, meetings = draw_particles(
        100.0 / tube(12.0), SIZES, beams.stretch, beams, np.random.default_rng(2)
    )
    count = len(meetings.beam)
    nearer = np.count_nonzero(particles.range < 6)
    share = tube(6.0) / tube(12.0)
    assert nearer / count == pytest.approx(share, abs=4 * math.sqrt(share * (1 - share) / count))
    large = SIZES.diameter >= 4e-3
    volume = [
        np.trapezoid(np.pi / 4 * (OPTICS.width(at := np.linspace(1, 12, 2001)) + one) ** 2, at)
        for one in SIZES.diameter
    ]
    share = float((SIZES.share * volume)[large].sum() / (SIZES.share * volume).sum())
    drawn = np.count_nonzero(particles.diameter >= 4e-3) / count
    assert drawn == pytest.approx(share, abs=4 * math.sqrt(share * (1 - share) / count))


@pytest.mark.parametrize("shadow", [False, True])
def test_beams_that_overlap_share_the_particles_of_the_space_that_they_fill(shadow: bool) -> None:
    """Places in a box around the beams are tried one by one; every third beam may end early."""
    far = np.where(np.arange(len(TOGETHER)) % 3 == 0, 12.0, 4.0 if shadow else 12.0)
    beams = open_beams(TOGETHER, far)
    generator = np.random.default_rng(3)
    low, high = np.array([0.9, -0.15, -0.1]), np.array([12.1, 0.15, 0.1])
    number, box = 3e4, float(np.prod(high - low))
    place = generator.uniform(low, high, (generator.poisson(number * box), 3))
    diameter = generator.choice(SIZES.diameter, len(place), p=SIZES.share)
    range_ = np.linalg.norm(place, axis=1)
    met = beams.tree.meetings(place, (OPTICS.width(range_) + diameter) / 2)
    at = range_[met.particle]
    met = met.take((at >= 1) & (at <= far[met.beam]))
    particles, meetings = draw_particles(number, SIZES, beams.stretch, beams, generator)

    expected = len(np.unique(met.particle))
    assert expected > 2000
    assert len(particles.diameter) == pytest.approx(expected, abs=4 * math.sqrt(2 * expected))
    ratio = len(met.beam) / expected
    assert ratio > 2
    assert len(meetings.beam) / len(particles.diameter) == pytest.approx(ratio, rel=0.1)


def test_the_same_beam_many_times_has_the_particles_of_one() -> None:
    one, many = open_beams(APART[:1]), open_beams(np.repeat(APART[:1], 7, axis=0))
    number = 4000.0 / tube(12.0)
    alone, _ = draw_particles(number, SIZES, one.stretch, one, np.random.default_rng(4))
    shared, meetings = draw_particles(number, SIZES, many.stretch, many, np.random.default_rng(5))
    assert len(shared.diameter) == pytest.approx(len(alone.diameter), abs=4 * math.sqrt(8000))
    assert len(meetings.beam) == 7 * len(shared.diameter)


def test_slices_count_what_would_be_seen_in_the_middle_of_a_beam() -> None:
    sensor = replace(SENSOR, detection_threshold=4e-6, maximum_range=60.0)
    optics = Optics.of(Precipitation(reflectivity=0.5), sensor)
    distance = np.linspace(1, 60, 20_001)
    width = optics.width(distance)[:, None]
    visible = SIZES.diameter >= optics.smallest_visible(distance)[:, None]
    area = visible * np.pi / 4 * (width + SIZES.diameter) ** 2
    exact = np.trapezoid((area * SIZES.share).sum(axis=1), distance)
    # The slices are as wide as at their far end.
    assert exact < Slices(1.0, optics, SIZES).met.sum() < 1.6 * exact


def test_beams_that_end_at_once_meet_nothing() -> None:
    beams = open_beams(APART, 0.5)
    particles, meetings = draw_particles(1e6, SIZES, beams.stretch, beams, np.random.default_rng(6))
    assert len(particles.diameter) == len(meetings.beam) == 0
