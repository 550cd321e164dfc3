"""Particles that beams meet on their way, and the light that these leave."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.random import Generator

from derain.simulation.arrays import Columns, Floats, Ints
from derain.simulation.flying.optics import Sizes
from derain.simulation.flying.particles import OpenBeams, draw_particles
from derain.simulation.flying.regions import Region

# A particle leaves at least so much of the light, a modelling choice: a little goes around it.
LEAST_LEFT = 1e-3


@dataclass(frozen=True, eq=False)
class Population:
    """Particles of a kind.

    Attributes:
        number: Particles per cubic metre where they are densest, m⁻³.
        sizes: Their diameters.
        region: Where they fly.
    """

    number: float
    sizes: Sizes
    region: Region


@dataclass(frozen=True, eq=False)
class Encounters(Columns):
    """Particles in beams, by beam and then by distance.

    Attributes:
        beam: Row of the beam, int64 (M,), ascending.
        range: Distance of the particle's front, float64 (M,), metres.
        covered: Share of the beam that it covers, float64 (M,), in 0..1.
        brightness: Apparent reflectivity of a particle that covers a whole beam, float64 (M,).
    """

    beam: Ints
    range: Floats
    covered: Floats
    brightness: Floats

    def ordered(self) -> Self:
        """The same by beam, and then by distance."""
        return self.take(np.lexsort((self.range, self.beam)))

    @property
    def reflectivity(self) -> Floats:
        """Apparent reflectivity behind the nearer particles of the beam, float64 (M,)."""
        # Sums up to a particle, less those of the beams before its own.
        loss = np.cumsum(self._loss) - self._loss
        first = np.searchsorted(self.beam, self.beam)
        return self.brightness * self.covered * np.exp(loss - loss[first])

    def transmission(self, beams: int) -> Floats:
        """Share of the light of each beam that passes all of its particles, float64 (beams,)."""
        return np.exp(np.bincount(self.beam, self._loss, minlength=beams))

    @property
    def _loss(self) -> Floats:
        """Logarithm of what a particle leaves on the way there and back, float64 (M,)."""
        return np.asarray(2 * np.log(np.maximum(1 - self.covered, LEAST_LEFT)))


def encounter(
    populations: Sequence[Population], beams: OpenBeams, flicker: float, generator: Generator
) -> Encounters:
    """Draws what the beams meet of all that flies.

    Args:
        populations: What flies, at least one.
        beams: The beams.
        flicker: By what share the reflectivity of single particles falls short at most.
        generator: Random generator.
    """
    met = [_encounters_with(population, beams, flicker, generator) for population in populations]
    return Encounters.joined(met).ordered()


def _encounters_with(
    population: Population, beams: OpenBeams, flicker: float, generator: Generator
) -> Encounters:
    stretch = population.region.stretch(beams.directions, beams.stretch)
    particles, meetings = draw_particles(
        population.number, population.sizes, stretch, beams, generator
    )
    # The density is uneven: of the densest, its share stays.
    there = generator.random(len(particles.diameter)) < population.region.density(particles.place)
    brightness = beams.optics.brightness * (1 - flicker * generator.random(len(there)))
    meetings = meetings.take(there[meetings.particle])
    particle = meetings.particle
    diameter, centre = particles.diameter[particle], particles.range[particle]
    covered = covered_share(beams.optics.width(centre), diameter, meetings.offset)
    # A beam is returned from somewhere between the particle's front and its middle.
    front = centre - diameter / 2 * generator.random(len(particle))
    return Encounters(meetings.beam, front, covered, brightness[particle])


def covered_share(beam: Floats, particle: Floats, offset: Floats) -> Floats:
    """Share of a beam's cross-section that a particle covers, float64 (M,), in 0..1.

    The area of the lens in which two discs overlap, over that of the first.

    Args:
        beam: Width of the beam where the particle is, float64 (M,), metres.
        particle: Its diameter, float64 (M,), metres.
        offset: Distance between their centres, float64 (M,), metres.
    """
    wide, narrow = np.maximum(beam, particle) / 2, np.minimum(beam, particle) / 2
    # Beyond these bounds the smaller disc is inside or outside the other as a whole.
    apart = np.clip(offset, wide - narrow, wide + narrow)
    with np.errstate(divide="ignore", invalid="ignore"):
        toward_wide = np.nan_to_num((apart**2 + wide**2 - narrow**2) / (2 * apart * wide), nan=1)
        toward_narrow = np.nan_to_num((apart**2 + narrow**2 - wide**2) / (2 * apart * narrow))
    kite = (wide + narrow) ** 2 - apart**2, apart**2 - (wide - narrow) ** 2
    lens = (
        wide**2 * np.arccos(np.clip(toward_wide, -1, 1))
        + narrow**2 * np.arccos(np.clip(toward_narrow, -1, 1))
        - np.sqrt(np.maximum(kite[0] * kite[1], 0)) / 2
    )
    lens = np.where(offset <= wide - narrow, np.pi * narrow**2, lens)
    return np.asarray(np.clip(lens / (np.pi * (beam / 2) ** 2), 0, 1))
