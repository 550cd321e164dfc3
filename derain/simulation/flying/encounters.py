"""Particles in beams: what the light meets on its way, nearest first."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from derain.simulation.flying.beam_tree import covered_share
from derain.simulation.flying.particles import OpenBeams, draw_particles
from derain.simulation.flying.regions import Region
from derain.simulation.flying.sizes import Sizes

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
class Encounters:
    """Particles in beams, by beam and then by distance.

    Attributes:
        beam: Row of the beam, int64 (M,), ascending.
        range: Distance of the particle's front, float64 (M,), metres.
        covered: Share of the beam that it covers, float64 (M,), in 0..1.
        brightness: Apparent reflectivity of a particle that covers a whole beam, float64 (M,).
    """

    beam: NDArray[np.int64]
    range: NDArray[np.float64]
    covered: NDArray[np.float64]
    brightness: NDArray[np.float64]

    @classmethod
    def none(cls) -> Self:
        """Clear air."""
        return cls(np.empty(0, np.int64), np.empty(0), np.empty(0), np.empty(0))

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """Several kinds of particles, in order of beam and distance."""
        parts = [cls.none(), *parts]
        beam = np.concatenate([part.beam for part in parts])
        distance = np.concatenate([part.range for part in parts])
        order = np.lexsort((distance, beam))
        return cls(
            beam[order],
            distance[order],
            np.concatenate([part.covered for part in parts])[order],
            np.concatenate([part.brightness for part in parts])[order],
        )

    @property
    def reflectivity(self) -> NDArray[np.float64]:
        """Apparent reflectivity behind the nearer particles of the beam, float64 (M,)."""
        # Sums up to a particle, less those of the beams before its own.
        loss = np.cumsum(self._loss) - self._loss
        first = np.searchsorted(self.beam, self.beam)
        return self.brightness * self.covered * np.exp(loss - loss[first])

    def transmission(self, beams: int) -> NDArray[np.float64]:
        """Share of the light of each beam that passes all of its particles, float64 (beams,)."""
        return np.exp(np.bincount(self.beam, self._loss, minlength=beams))

    @property
    def _loss(self) -> NDArray[np.float64]:
        """Logarithm of what a particle leaves on the way there and back, float64 (M,)."""
        return np.asarray(2 * np.log(np.maximum(1 - self.covered, LEAST_LEFT)))


def encounter(
    populations: Sequence[Population],
    beams: OpenBeams,
    flicker: float,
    generator: np.random.Generator,
) -> Encounters:
    """Draws what the beams meet of all that flies.

    Args:
        populations: What flies.
        beams: The beams.
        flicker: By what share the reflectivity of single particles falls short at most.
        generator: Random generator.
    """
    return Encounters.joined(
        [
            _encounters_with(population, beams, flicker, generator)
            for population in populations
            if population.number and len(beams.directions)
        ]
    )


def _encounters_with(
    population: Population, beams: OpenBeams, flicker: float, generator: np.random.Generator
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
