"""Returns near the sensor that are no single particles: fog-like air, and water on its window."""

import numpy as np
from numpy.random import Generator

from derain.simulation.arrays import Floats
from derain.simulation.classes import TrackClass
from derain.simulation.flying.gusts import Gusts
from derain.simulation.flying.precipitation import Precipitation
from derain.simulation.flying.sizes import nearest_seen
from derain.simulation.sensor import Returns, Sensor

# Shortest wave of the patches over the view, radians; the longest is four times it.
PATCH = 0.15


def draw_haze(
    clear: Returns,
    beams: Floats,
    precipitation: Precipitation,
    sensor: Sensor,
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
        sensor: The sensor.
        generator: Random generator.
    """
    share = np.full(len(beams), precipitation.haze)
    if precipitation.haze_patches and len(beams):
        field = Gusts("gusts", PATCH, precipitation.haze_patches, precipitation.gust_seed + 1)
        patches = field(beams)
        share *= patches / max(patches.mean(), 1e-9)
    lit = np.flatnonzero(generator.random(len(beams)) < share)
    depth = generator.exponential(precipitation.haze_depth, len(lit))
    distance = nearest_seen(precipitation, sensor) + depth
    ratio = precipitation.haze_strength ** generator.random(len(lit))
    in_front = (distance < clear.range[lit]) & (
        distance < min(sensor.maximum_range, precipitation.cut_off)
    )
    lit, distance = lit[in_front], distance[in_front]
    power = sensor.detection_threshold * ratio[in_front]
    return Returns(
        distance,
        # Upwards, so that no return falls short of the threshold by rounding.
        np.minimum(power * distance**2 * (1 + 1e-9), 1),
        np.full(len(lit), int(TrackClass.RAIN)),
        lit,
    )
