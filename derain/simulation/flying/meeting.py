"""Beams on their way through particles: those they meet, and the surfaces they still detect."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.random import Generator

from derain.simulation.arrays import Columns, Floats, Ints
from derain.simulation.classes import TrackClass
from derain.simulation.detection import detected_surfaces, reported
from derain.simulation.flying.beam_tree import covered_share
from derain.simulation.flying.gusts import Gusts
from derain.simulation.flying.haze import draw_haze
from derain.simulation.flying.particles import OpenBeams, Stretch, draw_particles
from derain.simulation.flying.precipitation import Precipitation
from derain.simulation.flying.regions import Air, GroundLayer, Region, draw_plumes
from derain.simulation.flying.sizes import Optics, Sizes, Slices, nearest_seen
from derain.simulation.sensor import Returns, Sensor

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

    @classmethod
    def none(cls) -> Self:
        """Clear air."""
        return cls(np.empty(0, np.int64), np.empty(0), np.empty(0), np.empty(0))

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
        populations: What flies.
        beams: The beams.
        flicker: By what share the reflectivity of single particles falls short at most.
        generator: Random generator.
    """
    met = [
        _encounters_with(population, beams, flicker, generator)
        for population in populations
        if population.number and len(beams.directions)
    ]
    return Encounters.joined([Encounters.none(), *met]).ordered()


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


# Spray has a mean diameter of .5 mm and at most 3, modelling choices: it is torn from rain.
SPRAY = Sizes.gamma(0.5, 1, 3.0)


def meet(
    clear: Returns,
    beams: Floats,
    precipitation: Precipitation,
    sensor: Sensor,
    generator: Generator,
) -> Returns:
    """Sends beams through what flies and keeps what the sensor reports of each.

    Particles have a place in space: one that is wide, or lies where beams overlap, is met by
    several. Each takes the share of the light that it covers from what lies behind it, on the way
    there and back. Besides, all that falls takes light evenly from all beams, as its mean density
    does; that those which are drawn one by one count in both is a modelling choice. A beam reports
    the strongest or the last of all that it could detect, or both.

    Args:
        clear: What each beam would return through clear air to a perfect detector: one row for
            each of the N beams, in their order.
        beams: Unit vectors along them, float64 (N, 3), sensor frame.
        precipitation: What flies.
        sensor: The sensor that they belong to.
        generator: Random generator.

    Returns:
        What the sensor detects, one row for each beam, what flies labelled RAIN; of a sensor with
        dual returns a second row where the last return is not the strongest.
    """
    falling = uncrowded(precipitation, sensor)
    sizes = _sizes(precipitation)
    gusts = Gusts(
        precipitation.gust_form,
        precipitation.gust_length,
        precipitation.gust_contrast,
        precipitation.gust_seed,
    )
    extinction = falling * gusts.mean * sizes.extinction
    layer = GroundLayer(-sensor.mounting_height, precipitation.drift_height, gusts)
    seen = clear, beams, -sensor.mounting_height
    plumes = draw_plumes(*seen, precipitation.plumes, precipitation.plume_length, generator)
    met = encounter(
        [
            Population(falling, sizes, Air(gusts)),
            Population(falling * precipitation.drift, sizes, layer),
            *(Population(precipitation.plume_number, SPRAY, plume) for plume in plumes),
        ],
        _open_beams(clear, beams, precipitation, sensor),
        precipitation.flicker,
        generator,
    )
    transmission = met.transmission(len(beams)) * np.exp(-2 * extinction * clear.range)
    candidates = [
        detected_surfaces(clear, transmission, sensor),
        _detected_particles(met, extinction, clear, precipitation, sensor, generator),
        draw_haze(clear, beams, precipitation, sensor, generator),
    ]
    return reported(Returns.joined(candidates), sensor.returns)


def uncrowded(precipitation: Precipitation, sensor: Sensor) -> float:
    """Falling particles per cubic metre, so few that no more than the crowding meet an open beam.

    Args:
        precipitation: What falls.
        sensor: Whose beams they are.
    """
    optics, sizes = Optics.of(precipitation, sensor), _sizes(precipitation)
    slices = Slices(nearest_seen(precipitation, sensor), optics, sizes)
    met = float(slices.met.sum())
    return min(precipitation.number, precipitation.crowding / met if met else precipitation.number)


def _sizes(precipitation: Precipitation) -> Sizes:
    return Sizes.gamma(precipitation.diameter, precipitation.shape, precipitation.largest)


def _open_beams(
    clear: Returns, beams: Floats, precipitation: Precipitation, sensor: Sensor
) -> OpenBeams:
    near = np.full(len(beams), nearest_seen(precipitation, sensor))
    return OpenBeams(beams, Stretch(near, clear.range), Optics.of(precipitation, sensor))


def _detected_particles(
    met: Encounters,
    extinction: float,
    clear: Returns,
    precipitation: Precipitation,
    sensor: Sensor,
    generator: Generator,
) -> Returns:
    """Particles that the sensor would see if it reported all that a beam returns."""
    reflectivity = met.reflectivity * np.exp(-2 * extinction * met.range)
    needed = sensor.detection_threshold * met.range**2
    seen = reflectivity >= needed
    distance, beam = met.range[seen], met.beam[seen]
    reflectivity, needed = reflectivity[seen], needed[seen]
    spread = precipitation.jitter * np.sqrt(needed / reflectivity)
    measured = distance + spread * generator.normal(size=len(distance))
    # Between the sensor's limits, and not behind the surface that ends the beam.
    measured = np.maximum(np.minimum(measured, clear.range[beam]), sensor.minimum_range)
    # The power is that of the true distance.
    return Returns(
        measured,
        np.minimum(reflectivity * (measured / distance) ** 2, 1),
        np.full(len(beam), int(TrackClass.RAIN)),
        beam,
    )
