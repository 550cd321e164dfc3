"""Returns near the sensor that are no single particles: fog-like air, and water on its window."""

import numpy as np
from numpy.typing import NDArray

from derain.simulation.classes import TrackClass
from derain.simulation.flying.gusts import Gusts
from derain.simulation.flying.precipitation import Precipitation
from derain.simulation.sensor import Returns, Sensor

# Size of the patches, in units of unit vectors: a tenth to a half of a radian.
PATCH = 0.15


def draw_haze(
    clear: Returns,
    beams: NDArray[np.float64],
    precipitation: Precipitation,
    sensor: Sensor,
    generator: np.random.Generator,
) -> Returns:
    """Draws what a haze returns: of a share of the beams, exponentially distributed in distance.

    The share of a beam is the mean one times e^(patches · a smooth random field over the view). How
    strong a return is over the threshold is uniform in its logarithm. All of it is a modelling
    choice; a surface nearer than the return takes its place.

    Source: the exponential is the law of a first return in an even medium, as in Goodin et al.
        2019, "Predicting the influence of rain on LIDAR in ADAS".
    """
    share = np.full(len(beams), precipitation.haze)
    if precipitation.haze_patches:
        field = Gusts("gusts", PATCH, precipitation.haze_patches, precipitation.gust_seed + 1)
        patches = field(beams)
        share *= patches / max(patches.mean(), 1e-9) if len(beams) else 1
    lit = np.flatnonzero(generator.random(len(beams)) < share)
    distance = sensor.minimum_range + generator.exponential(precipitation.haze_depth, len(lit))
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
