"""What beams return through clear air."""

import numpy as np
from numpy.random import Generator

from derain.simulation.classes import TrackClass
from derain.simulation.sensor import Returns, Sensor

FARTHEST = Sensor().maximum_range


def surfaces(
    count: int, distance: float, reflectivity: float, label: TrackClass = TrackClass.CAR
) -> Returns:
    """Beams that meet the same."""
    return Returns(
        np.full(count, distance),
        np.full(count, reflectivity),
        np.full(count, int(label)),
        np.arange(count),
    )


def random_surfaces(count: int, generator: Generator) -> Returns:
    """Surfaces near and far, bright and too dark to be seen, and beams that meet nothing."""
    nothing = generator.random(count) < 0.2
    return Returns(
        np.where(nothing, FARTHEST, generator.uniform(1, 100, count)),
        np.where(nothing, 0, 10 ** generator.uniform(-5, 0, count)),
        np.where(nothing, 0, generator.choice([0, 1, 2, 4, 5, 6, 7], count)),
        np.arange(count),
    )


def assert_kept_weaker_or_ends_at_a_particle_or_lost(
    clear: Returns, detected: Returns, sensor: Sensor
) -> None:
    """What holds of every beam, whatever flies: no energy comes from nowhere.

    Args:
        clear: What each beam would return through clear air, one row for each.
        detected: What the sensor reports of them.
        sensor: The sensor.
    """
    beam, returned = detected.beam, detected.returned
    wet = detected.label == TrackClass.RAIN
    kept = returned & ~wet
    assert set(beam) == set(range(len(clear.beam)))
    assert (np.diff(beam) >= 0).all()
    assert np.bincount(beam).max() <= (2 if sensor.returns == "dual" else 1)
    assert (detected.power[returned] >= sensor.detection_threshold * (1 - 1e-9)).all()
    assert (detected.reflectivity <= 1).all()
    assert returned[wet].all()
    assert (detected.range[wet] <= clear.range[beam[wet]]).all()
    assert (detected.range[wet] >= sensor.minimum_range * (1 - 1e-12)).all()
    assert (detected.range[kept] == clear.range[beam[kept]]).all()
    assert (detected.label[kept] == clear.label[beam[kept]]).all()
    assert (detected.reflectivity[kept] <= clear.reflectivity[beam[kept]]).all()
    assert (detected.range[~returned] == sensor.maximum_range).all()
    assert (detected.label[~returned] == TrackClass.BACKGROUND).all()
