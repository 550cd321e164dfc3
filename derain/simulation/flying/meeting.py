"""Beams among flying particles: the particles that they meet, and the sensor's reports."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator

from derain.scan import Floats, Ints
from derain.simulation.arrays import Columns
from derain.simulation.classes import TrackClass
from derain.simulation.flying.optics import Optics, Sizes, Slices
from derain.simulation.flying.particles import OpenBeams, Stretch, draw_particles
from derain.simulation.flying.precipitation import Precipitation
from derain.simulation.flying.regions import GroundLayer, Gusts, Region, draw_plumes
from derain.simulation.sensor import Returns, Sensor

# A particle leaves at least so much of the light, a modelling choice: a little goes around it.
LEAST_LEFT = 1e-3


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

    def ordered(self) -> "Encounters":
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


@dataclass(frozen=True, eq=False)
class Population:
    """Particles of a kind.

    Attributes:
        number: Particles per cubic metre where they are densest, m⁻³.
        sizes: Their diameters.
        region: Region of the particles.
    """

    number: float
    sizes: Sizes
    region: Region

    def met_by(self, beams: OpenBeams, flicker: float, generator: Generator) -> Encounters:
        """Draws what beams meet of them.

        Args:
            beams: The beams.
            flicker: By what share the reflectivity of single particles falls short at most.
            generator: Random generator.
        """
        stretch = self.region.stretch(beams.directions, beams.stretch)
        particles, meetings = draw_particles(self.number, self.sizes, stretch, beams, generator)
        # The density is uneven: of the densest, its share stays.
        there = generator.random(len(particles.diameter)) < self.region.density(particles.place)
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

    The area of the lens in which two discs overlap, divided by the area of the first disc.

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


# Spray has a mean diameter of .5 mm and at most 3, modelling choices: it is torn from rain.
SPRAY = Sizes.gamma(0.5, 1, 3.0)

# Shortest wave of the patches of haze over the view, radians; the longest is four times it.
PATCH = 0.15


def meet(
    clear: Returns, beams: Floats, weather: Precipitation, sensor: Sensor, generator: Generator
) -> Returns:
    """Sends beams through what flies and keeps what the sensor reports of each.

    Particles have a place in space: one that is wide, or lies where beams overlap, is met by
    several. Each takes the share of the light that it covers from what lies behind it, on the way
    there and back. Besides, all that falls takes light evenly from all beams, as its mean density
    does; that those which are drawn one by one count in both is a modelling choice. A beam reports
    the strongest or the last of all that it could detect, or both.

    Args:
        clear: Return of each beam through clear air to a perfect detector: one row for
            each of the N beams, in their order.
        beams: Unit vectors along them, float64 (N, 3), sensor frame.
        weather: The precipitation.
        sensor: The sensor that they belong to.
        generator: Random generator.

    Returns:
        What the sensor detects, one row for each beam, what flies labelled RAIN; of a sensor with
        dual returns a second row where the last return is not the strongest.
    """
    optics = Optics.of(weather, sensor)
    sizes = Sizes.gamma(weather.diameter, weather.shape, weather.largest)
    falling = uncrowded(weather, optics, sizes)
    gusts = Gusts(weather.gust_form, weather.gust_length, weather.gust_contrast, weather.gust_seed)
    extinction = falling * gusts.mean * sizes.extinction
    ground = -sensor.mounting_height
    layer = GroundLayer(ground, weather.drift_height, gusts)
    plumes = draw_plumes(clear, beams, ground, weather.plumes, weather.plume_length, generator)
    populations = [
        Population(falling, sizes, gusts),
        Population(falling * weather.drift, sizes, layer),
        *(Population(weather.plume_number, SPRAY, plume) for plume in plumes),
    ]
    stretch = Stretch(np.full(len(beams), optics.nearest), clear.range)
    open_beams = OpenBeams(beams, stretch, optics)
    met = Encounters.joined(
        population.met_by(open_beams, weather.flicker, generator) for population in populations
    ).ordered()
    reflectivity = met.reflectivity * np.exp(-2 * extinction * met.range)
    particles = Returns(met.range, reflectivity, np.full_like(met.beam, TrackClass.RAIN), met.beam)
    seen = particles.take(reflectivity >= sensor.detection_threshold * met.range**2)
    transmission = met.transmission(len(beams)) * np.exp(-2 * extinction * clear.range)
    candidates = [
        sensor.detected(clear, transmission),
        _jittered(seen, clear.range, weather.jitter, sensor, generator),
        draw_haze(clear, beams, weather, optics, generator),
    ]
    return sensor.reported(Returns.joined(candidates))


def uncrowded(weather: Precipitation, optics: Optics, sizes: Sizes) -> float:
    """Falling particles per cubic metre, so few that no more than the crowding meet an open beam.

    Args:
        weather: The precipitation.
        optics: Optics of the sensor for it.
        sizes: Diameters of the particles.
    """
    met = float(Slices(optics.nearest, optics, sizes).met.sum())
    return min(weather.number, weather.crowding / met if met else weather.number)


def _jittered(
    particles: Returns, reach: Floats, jitter: float, sensor: Sensor, generator: Generator
) -> Returns:
    """Particles at distances that are off, by their power, as the sensor measures them.

    Args:
        particles: Those that the sensor would see if it reported all that a beam returns.
        reach: Range at which each beam ends at a surface, float64 (N,), metres.
        jitter: Standard deviation at the detection threshold, metres.
        sensor: The sensor.
        generator: Random generator.
    """
    distance = particles.range
    needed = sensor.detection_threshold * distance**2
    spread = jitter * np.sqrt(needed / particles.reflectivity)
    measured = distance + spread * generator.normal(size=len(distance))
    # Between the sensor's limits, and not behind the surface that ends the beam.
    measured = np.maximum(np.minimum(measured, reach[particles.beam]), sensor.minimum_range)
    # The power depends on the true distance.
    reflectivity = np.minimum(particles.reflectivity * (measured / distance) ** 2, 1)
    return replace(particles, range=measured, reflectivity=reflectivity)


def draw_haze(
    clear: Returns, beams: Floats, weather: Precipitation, optics: Optics, generator: Generator
) -> Returns:
    """Draws what a haze returns: of a share of the beams, exponentially distributed in distance.

    The distance to the first of many weak scatterers in an even medium is exponential. Where there
    are patches, the share of a beam follows a smooth random field over the view with the stated
    share as its mean. The power of a return over the threshold is log-uniform. All of it is a
    modelling choice. Scatterers behind the surface that ends the beam are left out.

    Args:
        clear: Return of each beam through clear air.
        beams: Unit vectors along them, float64 (N, 3), sensor frame.
        weather: Precipitation, including its haze.
        optics: Optics of the sensor for it.
        generator: Random generator.
    """
    share = np.full(len(beams), weather.haze)
    if weather.haze_patches and len(beams):
        field = Gusts("gusts", PATCH, weather.haze_patches, weather.gust_seed + 1)
        patches = field.density(beams)
        share *= patches / max(patches.mean(), 1e-9)
    lit = np.flatnonzero(generator.random(len(beams)) < share)
    depth = generator.exponential(weather.haze_depth, len(lit))
    distance = optics.nearest + depth
    ratio = weather.haze_strength ** generator.random(len(lit))
    in_front = distance < np.minimum(clear.range[lit], optics.farthest)
    lit, distance = lit[in_front], distance[in_front]
    power = optics.threshold * ratio[in_front]
    # Upwards, so that no return falls short of the threshold by rounding.
    reflectivity = np.minimum(power * distance**2 * (1 + 1e-9), 1)
    return Returns(distance, reflectivity, np.full(len(lit), int(TrackClass.RAIN)), lit)
