"""Beams on their way through what flies: what of it they meet, and what they still see behind."""

import numpy as np
from numpy.typing import NDArray

from derain.simulation.classes import TrackClass
from derain.simulation.detection import detected_surfaces, joined, reported
from derain.simulation.flying.encounters import Encounters, Population, encounter
from derain.simulation.flying.gusts import Gusts
from derain.simulation.flying.haze import draw_haze
from derain.simulation.flying.optics import Optics, nearest_seen
from derain.simulation.flying.particles import OpenBeams, Stretch
from derain.simulation.flying.plumes import draw_plumes
from derain.simulation.flying.precipitation import Precipitation
from derain.simulation.flying.regions import Air, GroundLayer
from derain.simulation.flying.sizes import Sizes
from derain.simulation.flying.slices import Slices
from derain.simulation.sensor import Returns, Sensor

# Spray has a mean diameter of .5 mm and at most 3, modelling choices: it is torn from rain.
SPRAY = Sizes.gamma(0.5, 1, 3.0)


def meet(
    clear: Returns,
    beams: NDArray[np.float64],
    precipitation: Precipitation,
    sensor: Sensor,
    generator: np.random.Generator,
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
    plumes = draw_plumes(
        *(clear, beams, -sensor.mounting_height),
        *(precipitation.plumes, precipitation.plume_length),
        generator,
    )
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
    return reported(
        joined(
            detected_surfaces(clear, transmission, sensor),
            _detected_particles(met, extinction, clear, precipitation, sensor, generator),
            draw_haze(clear, beams, precipitation, sensor, generator),
        ),
        sensor.returns,
    )


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
    clear: Returns, beams: NDArray[np.float64], precipitation: Precipitation, sensor: Sensor
) -> OpenBeams:
    near = np.full(len(beams), nearest_seen(precipitation, sensor))
    return OpenBeams(beams, Stretch(near, clear.range), Optics.of(precipitation, sensor))


def _detected_particles(
    met: Encounters,
    extinction: float,
    clear: Returns,
    precipitation: Precipitation,
    sensor: Sensor,
    generator: np.random.Generator,
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
