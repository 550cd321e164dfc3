"""Haze against its closed form."""

import math

import numpy as np
import pytest

from derain.simulation.classes import TrackClass
from derain.simulation.flying.haze import draw_haze
from derain.simulation.flying.precipitation import Precipitation
from derain.simulation.sensor import Returns, Sensor

SENSOR = Sensor(columns=500, rows=40, minimum_range=0.5)
BEAMS = SENSOR.beams()


def walls(distance: float) -> Returns:
    count = len(BEAMS)
    return Returns(
        np.full(count, distance), np.full(count, 0.5), np.full(count, 1), np.arange(count)
    )


def test_a_share_of_the_beams_returns_haze_at_exponential_distances() -> None:
    drizzle = Precipitation(haze=0.2, haze_depth=3.0, haze_strength=50.0)
    haze = draw_haze(walls(6.0), BEAMS, drizzle, SENSOR, np.random.default_rng(1))
    share = 0.2 * -math.expm1(-(6.0 - 0.5) / 3.0)
    error = math.sqrt(share * (1 - share) / len(BEAMS))
    assert len(haze.beam) / len(BEAMS) == pytest.approx(share, abs=4 * error)
    half = np.count_nonzero(haze.range < 0.5 + 3 * math.log(2)) / len(BEAMS)
    assert half == pytest.approx(0.1, abs=4 * math.sqrt(0.09 / len(BEAMS)))
    assert (haze.range < 6.0).all()
    assert (haze.power >= SENSOR.detection_threshold).all()
    assert (haze.power <= 50 * SENSOR.detection_threshold * (1 + 1e-6)).all()
    assert (haze.label == TrackClass.RAIN).all()


def test_patches_keep_the_share_and_gather_it() -> None:
    def shares(patches: float) -> np.ndarray:
        water = Precipitation(haze=0.1, haze_depth=0.5, haze_patches=patches)
        haze = draw_haze(walls(50.0), BEAMS, water, SENSOR, np.random.default_rng(2))
        hit = np.bincount(haze.beam, minlength=len(BEAMS))
        return hit.reshape(4, 10, 50, 10).mean(axis=(1, 3))

    even, patchy = shares(0.0), shares(3.0)
    assert even.mean() == pytest.approx(0.1, abs=0.01)
    assert patchy.mean() == pytest.approx(0.1, abs=0.01)
    assert patchy.std() > 2 * even.std()
