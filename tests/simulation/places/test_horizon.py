"""What is far away, as it is laid out and as a sensor sees it."""

from types import ModuleType

import numpy as np

from derain.simulation.classes import TrackClass
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


def test_a_horizon_is_of_triangles_that_can_be_seen() -> None:
    for seed in SEEDS:
        track = horizon(seed)
        assert 5_000 < len(track.label) < 80_000
        assert np.isfinite(track.triangles).all()
        assert 0 < track.reflectivity.min() <= track.reflectivity.max() <= 1
        assert set(track.label) <= {TrackClass.BACKGROUND, TrackClass.CAR}


def test_a_horizon_is_far() -> None:
    for seed in SEEDS:
        x, y = nearest_to_axis(horizon(seed).triangles.astype(float))
        assert np.hypot(x, y).min() > 40


def test_a_seed_gives_the_same_horizon_again_and_another_seed_another_one() -> None:
    first, again, other = horizon(0), horizon(0), horizon(1)
    assert np.array_equal(first.triangles, again.triangles)
    assert np.array_equal(first.reflectivity, again.reflectivity)
    assert not np.array_equal(first.triangles[-1], other.triangles[-1])


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
