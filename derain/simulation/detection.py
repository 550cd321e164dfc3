"""Which of the things in its beams a sensor reports."""

import numpy as np

from derain.simulation.arrays import Floats, Ints
from derain.simulation.classes import TrackClass
from derain.simulation.sensor import ReturnMode, Returns, Sensor


def detected_surfaces(clear: Returns, transmission: Floats, sensor: Sensor) -> Returns:
    """What the sensor would see of the surfaces if there were no particles in front of them.

    Args:
        clear: What each beam would return through clear air to a perfect detector.
        transmission: Share of the light that survives the way there and back, float64 (N,).
        sensor: The sensor.
    """
    reflectivity = clear.reflectivity * transmission
    strong = reflectivity >= sensor.detection_threshold * clear.range**2
    seen = strong & (clear.range >= sensor.minimum_range)
    return Returns(
        np.where(seen, clear.range, sensor.maximum_range),
        np.where(seen, reflectivity, 0),
        np.where(seen, clear.label, TrackClass.BACKGROUND),
        clear.beam,
    )


def reported(candidates: Returns, returns: ReturnMode) -> Returns:
    """What the sensor reports of all that it could detect.

    Args:
        candidates: At least one row for every beam; of a beam that nothing returned one without
            reflectivity. In any order.
        returns: What the sensor reports of a beam that several things return.

    Returns:
        One row for each beam, in their order; of a sensor with dual returns a second one where the
        last return is not the strongest.
    """
    # A surface ends its beam: where it is seen, it is the last return.
    distance = np.where(candidates.returned, candidates.range, 0)
    match returns:
        case "strongest":
            chosen = _greatest(candidates.power, candidates.beam)
        case "last":
            chosen = _greatest(distance, candidates.beam)
        case "dual":
            strongest = _greatest(candidates.power, candidates.beam)
            last = _greatest(distance, candidates.beam)
            both = np.stack([strongest, last], axis=1)
            chosen = both[np.stack([np.ones_like(last, bool), last != strongest], axis=1)]
    return candidates.take(chosen)


def _greatest(value: Floats, beam: Ints) -> Ints:
    """Row of the greatest value of every beam, int64 (N,), where each of N beams has one."""
    ascending = np.argsort(value, kind="stable")
    row = np.empty(beam.max(initial=-1) + 1, np.int64)
    row[beam[ascending]] = ascending  # of several rows the last assigned stays
    return row
