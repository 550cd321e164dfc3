"""Beams on their way through all that flies: what the sensor still reports of each."""

import numpy as np
from numpy.random import Generator

from derain.simulation.arrays import Floats
from derain.simulation.classes import TrackClass
from derain.simulation.flying.encounters import Encounters, Population, encounter
from derain.simulation.flying.optics import Optics, Sizes, Slices
from derain.simulation.flying.particles import OpenBeams, Stretch
from derain.simulation.flying.precipitation import Precipitation
from derain.simulation.flying.regions import GroundLayer, Gusts, draw_plumes
from derain.simulation.sensor import Returns, Sensor

# Spray has a mean diameter of .5 mm and at most 3, modelling choices: it is torn from rain.
SPRAY = Sizes.gamma(0.5, 1, 3.0)

# Shortest wave of the patches of haze over the view, radians; the longest is four times it.
PATCH = 0.15


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
    optics = Optics.of(precipitation, sensor)
    sizes = Sizes.gamma(precipitation.diameter, precipitation.shape, precipitation.largest)
    falling = uncrowded(precipitation, optics, sizes)
    gusts = Gusts(
        precipitation.gust_form,
        precipitation.gust_length,
        precipitation.gust_contrast,
        precipitation.gust_seed,
    )
    extinction = falling * gusts.mean * sizes.extinction
    ground = -sensor.mounting_height
    layer = GroundLayer(ground, precipitation.drift_height, gusts)
    plumes = draw_plumes(
        clear, beams, ground, precipitation.plumes, precipitation.plume_length, generator
    )
    populations = [
        Population(falling, sizes, gusts),
        Population(falling * precipitation.drift, sizes, layer),
        *(Population(precipitation.plume_number, SPRAY, plume) for plume in plumes),
    ]
    stretch = Stretch(np.full(len(beams), optics.nearest), clear.range)
    open_beams = OpenBeams(beams, stretch, optics)
    met = encounter(populations, open_beams, precipitation.flicker, generator)
    transmission = met.transmission(len(beams)) * np.exp(-2 * extinction * clear.range)
    candidates = [
        sensor.detected(clear, transmission),
        _detected_particles(met, extinction, clear, precipitation, sensor, generator),
        draw_haze(clear, beams, precipitation, optics, generator),
    ]
    return sensor.reported(Returns.joined(candidates))


def uncrowded(precipitation: Precipitation, optics: Optics, sizes: Sizes) -> float:
    """Falling particles per cubic metre, so few that no more than the crowding meet an open beam.

    Args:
        precipitation: What falls.
        optics: What the sensor sees of it.
        sizes: Diameters of the particles.
    """
    met = float(Slices(optics.nearest, optics, sizes).met.sum())
    return min(precipitation.number, precipitation.crowding / met if met else precipitation.number)


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


def draw_haze(
    clear: Returns,
    beams: Floats,
    precipitation: Precipitation,
    optics: Optics,
    generator: Generator,
) -> Returns:
    """Draws what a haze returns: of a share of the beams, exponentially distributed in distance.

    The distance to the first of many weak scatterers in an even medium is exponential. Where there
    are patches, the share of a beam follows a smooth random field over the view, whose mean is the
    share asked for. The power of a return over the threshold is log-uniform. All of it
    is a modelling choice; what would lie behind the surface that ends the beam is left out.

    Args:
        clear: What each beam would return through clear air.
        beams: Unit vectors along them, float64 (N, 3), sensor frame.
        precipitation: What flies, the haze in it.
        optics: What the sensor sees of it.
        generator: Random generator.
    """
    share = np.full(len(beams), precipitation.haze)
    if precipitation.haze_patches and len(beams):
        field = Gusts("gusts", PATCH, precipitation.haze_patches, precipitation.gust_seed + 1)
        patches = field.density(beams)
        share *= patches / max(patches.mean(), 1e-9)
    lit = np.flatnonzero(generator.random(len(beams)) < share)
    depth = generator.exponential(precipitation.haze_depth, len(lit))
    distance = optics.nearest + depth
    ratio = precipitation.haze_strength ** generator.random(len(lit))
    in_front = distance < np.minimum(clear.range[lit], optics.farthest)
    lit, distance = lit[in_front], distance[in_front]
    power = optics.threshold * ratio[in_front]
    return Returns(
        distance,
        # Upwards, so that no return falls short of the threshold by rounding.
        np.minimum(power * distance**2 * (1 + 1e-9), 1),
        np.full(len(lit), int(TrackClass.RAIN)),
        lit,
    )
