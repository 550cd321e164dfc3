"""What is far away, as it is laid out and as a sensor sees it."""

from types import ModuleType

import numpy as np

from derain.simulation.places.horizon import lay_out_horizon
from derain.simulation.sensor import Sensor
from derain.simulation.shapes import nearest_to_axis
from derain.simulation.track import Track

SEEDS = range(8)
SENSOR = Sensor(
    azimuth=(-180, 180),
    inclination=(-10, 10),
    rows=64,
    columns=1440,
    mounting_height=1.8,
    maximum_range=300.0,
)


def horizon(seed: int) -> Track:
    return Track.of(lay_out_horizon(np.random.default_rng(seed)))


def test_a_horizon_is_far() -> None:
    for seed in SEEDS:
        x, y = nearest_to_axis(horizon(seed).triangles.astype(float))
        assert np.hypot(x, y).min() > 40


def test_returns_come_from_afar_and_many_by_themselves(open3d: ModuleType) -> None:
    far, alone = 0, 0
    for seed in SEEDS:
        returns = horizon(seed).cast(SENSOR)
        returned = returns.power > SENSOR.detection_threshold
        far += ((returns.range > 150) & returned).sum()
        distance = np.where(returned, returns.range, 1e6).reshape(64, 1440)
        around = [np.roll(distance, step, axis) for axis in (0, 1) for step in (-1, 1)]
        gaps = np.min(np.abs(distance - np.stack(around)), axis=0)
        alone += (gaps[distance < 1e6] > 3).sum()
    assert far > 200
    assert alone > 200
