"""What carries a sensor, as the sensor sees it."""

from types import ModuleType

import numpy as np
import pytest

from derain.simulation.classes import TrackClass
from derain.simulation.places.carrier import lay_out_carrier
from derain.simulation.sensor import Sensor
from derain.simulation.track import Track


@pytest.mark.parametrize("height", [0.5, 1.8, 5.0])
def test_a_carrier_is_near_and_dark_and_nowhere_nearer_than_a_tenth_of_a_metre(
    open3d: ModuleType, height: float
) -> None:
    all_around = Sensor(
        azimuth=(-180, 180), inclination=(-80, 60), rows=70, columns=360, mounting_height=height
    )
    shares = []
    for seed in range(12):
        surfaces = list(lay_out_carrier(np.random.default_rng(seed), height))
        if not surfaces:
            continue
        track = Track.of(surfaces)
        assert set(track.label) == {TrackClass.BACKGROUND}
        assert len(track.label) < 10_000
        assert np.hypot(*track.triangles[..., :2].reshape(-1, 2).T).max() < 5
        seen = track.cast(all_around)
        assert seen.range.min() > 0.1
        close = seen.range < 3
        assert close.any()
        shares.append((seen.power[close] >= all_around.detection_threshold).mean())
    # Mirrors hide much of what is behind some of them, and return next to nothing.
    assert np.mean(np.array(shares) > 0) > 0.5
    assert min(shares) < 0.1
    assert max(shares) > 0.3


def test_some_sensors_see_no_carrier() -> None:
    empty = [not list(lay_out_carrier(np.random.default_rng(seed), 1.8)) for seed in range(80)]
    assert 0.08 < np.mean(empty) < 0.35
