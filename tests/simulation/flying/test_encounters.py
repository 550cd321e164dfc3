"""What the light loses to particles, against a loop over every beam."""

import numpy as np
import pytest
from numpy.random import Generator

from derain.simulation.flying.gusts import Gusts
from derain.simulation.flying.meeting import Encounters, Population, encounter
from derain.simulation.flying.particles import OpenBeams, Stretch
from derain.simulation.flying.precipitation import Precipitation
from derain.simulation.flying.regions import Air
from derain.simulation.flying.sizes import Optics, Sizes
from derain.simulation.sensor import Sensor

# Columns are .87 mrad apart, and beams .3 mrad wide.
SENSOR = Sensor(
    azimuth=(-10, 10),
    columns=401,
    rows=20,
    beam_divergence=0.3e-3,
    minimum_range=2.0,
    maximum_range=20.0,
    detection_threshold=1e-12,
)
AIR = Air(Gusts("even", 1, 1, 0))


def met(diameter: float, number: float, seed: int) -> Encounters:
    """What the sensor's open beams meet of particles of about one diameter, millimetres."""
    directions = SENSOR.beams()
    stretch = Stretch(np.full(len(directions), 2.0), np.full(len(directions), 20.0))
    beams = OpenBeams(directions, stretch, Optics.of(Precipitation(), SENSOR))
    sizes = Sizes.gamma(diameter, 1e4, 2 * diameter)
    return encounter([Population(number, sizes, AIR)], beams, 0, np.random.default_rng(seed))


def random_encounters(generator: Generator) -> Encounters:
    """Of thirty beams, in order, those that are divisible by five with none."""
    beam = generator.choice([row for row in range(30) if row % 5], 200)
    part = Encounters(
        beam, generator.uniform(1, 20, 200), generator.uniform(0, 1, 200), generator.random(200)
    )
    return part.ordered()


def test_each_particle_stands_in_the_shadow_of_those_before_it() -> None:
    found = random_encounters(np.random.default_rng(1))
    transmission = found.transmission(30)
    seen = found.reflectivity
    for beam in range(30):
        left = 1.0
        rows = np.flatnonzero(found.beam == beam)
        for row in rows[np.argsort(found.range[rows])]:
            assert seen[row] == pytest.approx(found.brightness[row] * found.covered[row] * left)
            left *= max(1 - found.covered[row], 1e-3) ** 2
        assert transmission[beam] == pytest.approx(left)


def test_clear_air_takes_nothing() -> None:
    assert (Encounters.none().transmission(3) == 1).all()
    assert len(Encounters.none().reflectivity) == 0


def neighbours_that_share(found: Encounters) -> float:
    """Share of what is met with something at the same distance in the next beam of the row."""
    by_beam = np.full((SENSOR.rows, SENSOR.columns), np.nan)
    by_beam.ravel()[found.beam] = found.range
    beside = np.abs(np.diff(by_beam, axis=1)) < 0.03
    return float(beside.sum() / np.isfinite(by_beam).sum())


def test_neighbouring_beams_meet_one_large_particle_and_not_one_small() -> None:
    # From 2 m on two columns are farther apart than a beam and a particle of 1 mm are wide; up to
    # 20 m they are nearer than half a particle of 40 mm.
    large, small = met(39.9, 0.5, seed=2), met(1.0, 60.0, seed=3)
    assert len(large.beam) > 100
    assert len(small.beam) > 100
    # Of k beams in a row that meet one particle, k - 1 have the next to their right.
    assert neighbours_that_share(small) < 0.05
    assert neighbours_that_share(large) > 0.5


def test_a_particle_is_met_in_front_of_its_middle_and_within_its_radius() -> None:
    found = met(20.0, 3.0, seed=4)
    assert (found.range >= 2 - 0.011).all()
    assert (found.range <= 20).all()
    assert (np.diff(found.beam) >= 0).all()
