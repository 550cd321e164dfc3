"""Rain as a LiDAR meets it: what is returned by drops, what comes through, what is lost."""

import numpy as np
from numpy.typing import NDArray

from derain.simulation.classes import TrackClass
from derain.simulation.detection import detected_surfaces, joined, reported
from derain.simulation.drops import (
    draw_drops,
    drop_reflectivity,
    farthest_visible_drop,
    thin_out,
)
from derain.simulation.rain_field import RainField
from derain.simulation.sensor import Returns, Sensor
from derain.simulation.transmission import Transmission


def rain_on_beams(
    clear: Returns,
    beams: NDArray[np.float64],
    rain: RainField,
    sensor: Sensor,
    generator: np.random.Generator,
) -> Returns:
    """Sends beams through rain and keeps what the sensor reports of each.

    A beam's return stays (weakened by the rain on its way there and back), gives way to a drop in
    front of it, or is lost because nothing reaches the detection threshold. A beam that nothing
    returned ends at the maximum range, and can still meet a drop.

    Args:
        clear: What each beam would return through clear air to a perfect detector: one row for
            each of the N beams, in their order.
        beams: Unit vectors along them, float64 (N, 3), sensor frame.
        rain: The rain.
        sensor: The sensor that they belong to.
        generator: Random generator.

    Returns:
        What the sensor detects, one row for each beam; of a sensor with dual returns a second one
        where the last return is not the strongest.
    """
    transmission = Transmission(rain, sensor.maximum_range)
    solid = detected_surfaces(clear, transmission(beams, clear.range), sensor)
    drops = _visible_drops(clear.range, beams, rain, sensor, transmission, generator)
    return reported(joined(solid, drops), sensor.returns)


def _visible_drops(
    reach: NDArray[np.float64],
    beams: NDArray[np.float64],
    rain: RainField,
    sensor: Sensor,
    transmission: Transmission,
    generator: np.random.Generator,
) -> Returns:
    """Drops that the sensor would see if there were nothing else in their beams."""
    # A drop that could not be seen even through clear air is left out first, which saves work.
    reach = np.minimum(reach, farthest_visible_drop(sensor))
    drops = draw_drops(rain.heaviest, reach, sensor, generator)
    needed = sensor.detection_threshold * drops.range**2
    drops = drops.take(drop_reflectivity(drops, sensor) >= needed)
    drops = thin_out(drops, beams, rain, generator)
    reflectivity = drop_reflectivity(drops, sensor) * transmission(beams[drops.beam], drops.range)
    seen = reflectivity >= sensor.detection_threshold * drops.range**2
    label = np.full(np.count_nonzero(seen), TrackClass.RAIN, np.int64)
    return Returns(drops.range[seen], reflectivity[seen], label, drops.beam[seen])
