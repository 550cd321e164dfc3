"""Which beams meet a particle against all of them, and lenses against counted points."""

import math

import numpy as np
import pytest

from derain.simulation.flying import beam_tree
from derain.simulation.flying.beam_tree import BeamTree, covered_share
from derain.simulation.sensor import Sensor

BEAMS = Sensor(columns=60, rows=20, azimuth=(-5, 5), inclination=(-3, 3)).beams()


@pytest.mark.parametrize("pairs_at_once", [1, 2**22])
def test_meetings_are_those_found_by_looking_at_every_beam(
    pairs_at_once: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(beam_tree, "PAIRS_AT_ONCE", pairs_at_once)
    generator = np.random.default_rng(1)
    far = generator.uniform(0.3, 30, 80)
    place = BEAMS[generator.integers(len(BEAMS), size=80)] * far[:, None]
    place += generator.normal(0, 0.01, place.shape)
    within = generator.choice([0.001, 0.01, 0.1, 2.0], 80)

    meetings = BeamTree(BEAMS).meetings(place, within)
    range_ = np.linalg.norm(place, axis=1)
    chord = np.linalg.norm(place[:, None] / range_[:, None, None] - BEAMS, axis=2)
    offset = chord * range_[:, None]
    met = np.argwhere(offset < within[:, None])
    assert len(met) > 1200  # some meet all of the beams, some meet none
    found = np.stack([meetings.particle, meetings.beam], axis=1)
    assert {tuple(pair) for pair in found} == {tuple(pair) for pair in met}
    assert len(found) == len(met)
    assert (np.diff(meetings.particle) >= 0).all()
    assert np.allclose(meetings.offset, offset[meetings.particle, meetings.beam], atol=1e-9)
    assert (BeamTree(BEAMS).nearest(place) == offset.argmin(axis=1)).all()


def test_no_particles_meet_no_beam() -> None:
    assert len(BeamTree(BEAMS).meetings(np.empty((0, 3)), np.empty(0)).beam) == 0


@pytest.mark.parametrize("diameter", [0.3, 0.8, 1.0, 1.5, 4.0])
@pytest.mark.parametrize("offset", [0.0, 0.2, 0.5, 0.9, 1.6])
def test_a_particle_covers_the_lens_of_both_discs(diameter: float, offset: float) -> None:
    step = np.linspace(-0.5, 0.5, 2001)
    across, up = np.meshgrid(step, step)
    beam = across**2 + up**2 < 0.25
    particle = (across - offset) ** 2 + up**2 < diameter**2 / 4
    counted = np.count_nonzero(beam & particle) / np.count_nonzero(beam)
    share = covered_share(np.ones(1), np.array([diameter]), np.array([offset]))[0]
    assert share == pytest.approx(counted, abs=2e-3)


def test_equal_discs_half_a_diameter_apart_overlap_by_the_known_lens() -> None:
    share = covered_share(np.ones(1), np.ones(1), np.array([0.5]))[0]
    assert share == pytest.approx(2 / 3 - math.sqrt(3) / (2 * math.pi))
