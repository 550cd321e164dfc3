"""Rain as a LiDAR meets it: what is returned by drops, what comes through, what is lost."""

import numpy as np
from numpy.typing import NDArray

from derain.simulation.classes import TrackClass
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
    solid = _detected_surfaces(clear, transmission(beams, clear.range), sensor)
    drops = _visible_drops(clear.range, beams, rain, sensor, transmission, generator)
    candidates = _joined(solid, drops)
    # A surface ends its beam: where it is seen, it is the last return.
    distance = np.where(candidates.returned, candidates.range, 0)
    match sensor.returns:
        case "strongest":
            chosen = _greatest(candidates.power, candidates.beam)
        case "last":
            chosen = _greatest(distance, candidates.beam)
        case "dual":
            strongest = _greatest(candidates.power, candidates.beam)
            last = _greatest(distance, candidates.beam)
            both = np.stack([strongest, last], axis=1)
            chosen = both[np.stack([np.ones_like(last, bool), last != strongest], axis=1)]
    return _taken(candidates, chosen)


def _detected_surfaces(
    clear: Returns, transmission: NDArray[np.float64], sensor: Sensor
) -> Returns:
    """What the sensor would see of the surfaces if there were no drops in front of them."""
    reflectivity = clear.reflectivity * transmission
    strong = reflectivity >= sensor.detection_threshold * clear.range**2
    seen = strong & (clear.range >= sensor.minimum_range)
    return Returns(
        np.where(seen, clear.range, sensor.maximum_range),
        np.where(seen, reflectivity, 0),
        np.where(seen, clear.label, TrackClass.BACKGROUND),
        clear.beam,
    )


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


def _joined(first: Returns, second: Returns) -> Returns:
    return Returns(
        np.concatenate([first.range, second.range]),
        np.concatenate([first.reflectivity, second.reflectivity]),
        np.concatenate([first.label, second.label]),
        np.concatenate([first.beam, second.beam]),
    )


def _greatest(value: NDArray[np.float64], beam: NDArray[np.int64]) -> NDArray[np.int64]:
    """Row of the greatest value of every beam, int64 (N,), where each of N beams has one."""
    ascending = np.argsort(value, kind="stable")
    row = np.empty(beam.max(initial=-1) + 1, np.int64)
    row[beam[ascending]] = ascending  # of several rows the last assigned stays
    return row


def _taken(returns: Returns, rows: NDArray[np.int64]) -> Returns:
    return Returns(
        returns.range[rows], returns.reflectivity[rows], returns.label[rows], returns.beam[rows]
    )
