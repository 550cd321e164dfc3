"""What carries a sensor, as the sensor sees it."""

from types import ModuleType

import numpy as np
import pytest

from derain.simulation.classes import TrackClass
from derain.simulation.places.carrier import lay_out_carrier
from derain.simulation.places.horizon import lay_out_horizon
from derain.simulation.sensor import Returns, Sensor
from derain.simulation.track import Track

HEIGHTS = [0.3, 0.8, 1.31, 1.8, 3.0, 5.0]
SEEDS = range(12)


def carrier(seed: int, height: float) -> Track | None:
    surfaces = list(lay_out_carrier(np.random.default_rng(seed), height))
    return Track.of(surfaces) if surfaces else None


def carriers(height: float) -> list[Track]:
    return [track for seed in SEEDS if (track := carrier(seed, height)) is not None]


def sensor(height: float) -> Sensor:
    """One that sees all around and nearly straight up and down."""
    return Sensor(
        azimuth=(-180, 180), inclination=(-80, 60), rows=70, columns=360, mounting_height=height
    )


def detected(track: Track, seeing: Sensor) -> Returns:
    """Returns of a track, and which of them are strong enough."""
    returns = track.cast(seeing)
    returns.reflectivity[returns.power < seeing.detection_threshold] = 0
    return returns


@pytest.mark.parametrize("height", HEIGHTS)
def test_a_carrier_is_near_and_dark_and_of_the_background(height: float) -> None:
    for track in carriers(height):
        assert set(track.label) == {TrackClass.BACKGROUND}
        assert len(track.label) < 10_000
        horizontal = np.hypot(track.triangles[..., 0], track.triangles[..., 1])
        assert horizontal.max() < 5
        assert track.triangles[..., 2].min() > -1


@pytest.mark.parametrize("height", HEIGHTS)
def test_rays_meet_a_carrier_and_none_ends_nearer_than_a_tenth_of_a_metre(
    open3d: ModuleType, height: float
) -> None:
    met, near = [], []
    for track in carriers(height):
        distance = track.cast(sensor(height)).range
        assert distance.min() > 0.1
        close = distance < 3
        met.append(close.sum())
        near.append((close & detected(track, sensor(height)).returned).sum())
    assert min(met) > 0
    assert np.mean(np.array(near) > 0) > 0.5
    # Mirrors hide much of what is behind some of them, and return next to nothing.
    shares = np.array(near) / met
    assert shares.min() < 0.1
    assert shares.max() > 0.3


def test_some_sensors_see_no_carrier() -> None:
    empty = [carrier(seed, 1.8) is None for seed in range(80)]
    assert 0.08 < np.mean(empty) < 0.35


def test_surfaces_are_added_to_a_track_behind_what_it_has() -> None:
    track, added = carriers(1.8)[0], list(lay_out_horizon(np.random.default_rng(1)))
    joined = track.with_surfaces(added)
    assert np.array_equal(joined.triangles[: len(track.label)], track.triangles)
    assert np.array_equal(joined.triangles[len(track.label) :], Track.of(added).triangles)
    assert len(joined.label) == len(joined.reflectivity) == len(joined.triangles)
    assert track.with_surfaces(()) is track
