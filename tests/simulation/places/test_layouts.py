"""Every place, as it is laid out and as a sensor sees it."""

from collections.abc import Callable
from functools import cache
from types import ModuleType

import numpy as np
import pytest
from numpy.random import Generator

from derain.cli.simulate import LAYOUT_NAMES
from derain.simulation.arrays import Floats, Ints
from derain.simulation.classes import TrackClass
from derain.simulation.layouts import LAYOUTS
from derain.simulation.places.carrier import lay_out_carrier
from derain.simulation.places.horizon import lay_out_horizon
from derain.simulation.sensor import Sensor
from derain.simulation.track import Track

EVERYTHING: dict[str, Callable[[Generator], Track]] = {
    **LAYOUTS,
    "horizon": lambda generator: Track.of(lay_out_horizon(generator)),
    "carrier": lambda generator: Track.of(lay_out_carrier(generator, 1.8)),
}

# A room is smaller than what is asked of the places outdoors.
PLACES = sorted(set(LAYOUTS) - {"street", "facility", "room"})

# Seen all around, up and down, from the height of a car's roof.
SENSOR = Sensor(
    azimuth=(-180, 180), inclination=(-30, 30), rows=32, columns=720, mounting_height=1.6
)

# Nothing but the ground, and a ceiling, is nearer to the sensor's place, metres.
CLEARANCE = 1.5


@cache
def laid_out(place: str, seed: int) -> Track:
    return EVERYTHING[place](np.random.default_rng(seed))


@cache
def seen(place: str, seed: int) -> tuple[Floats, Ints]:
    """Where the beams that return end as the sensor sees it, float64 (N, 3), and on what."""
    returns = laid_out(place, seed).cast(SENSOR)
    ends = (SENSOR.beams() * returns.range[:, None])[returns.returned]
    return ends, returns.label[returns.returned]


def test_the_command_knows_every_layout() -> None:
    assert set(LAYOUT_NAMES) == set(LAYOUTS)


@pytest.mark.parametrize("place", EVERYTHING)
def test_a_place_is_of_triangles_that_can_be_seen(place: str) -> None:
    for seed in (0, 1):
        track = laid_out(place, seed)
        assert len(track.label) == len(track.triangles) == len(track.reflectivity) < 500_000
        assert np.isfinite(track.triangles).all()
        assert 0 < track.reflectivity.min() <= track.reflectivity.max() <= 1
        assert set(track.label) <= set(TrackClass) - {TrackClass.RAIN}


@pytest.mark.parametrize("place", EVERYTHING)
def test_a_seed_gives_the_same_place_again_and_another_seed_another_one(place: str) -> None:
    again = EVERYTHING[place](np.random.default_rng(0))
    assert np.array_equal(laid_out(place, 0).triangles, again.triangles)
    assert np.array_equal(laid_out(place, 0).reflectivity, again.reflectivity)
    assert len(again.label) != len(laid_out(place, 1).label)


@pytest.mark.parametrize("place", ["street", "facility"])
def test_every_class_but_rain_stands_on_a_test_track(place: str) -> None:
    for seed in range(5):
        assert set(laid_out(place, seed).label) == set(TrackClass) - {TrackClass.RAIN}


@pytest.mark.parametrize("place", PLACES)
def test_nothing_is_at_the_place_of_the_sensor(open3d: ModuleType, place: str) -> None:
    for seed in (0, 1):
        ends, _ = seen(place, seed)
        level = np.abs(ends[:, 2]) < 1.0  # neither the ground nor a ceiling
        assert np.linalg.norm(ends[level], axis=1).min() > CLEARANCE


@pytest.mark.parametrize("place", PLACES)
def test_people_cars_and_the_rest_are_near_and_all_around(open3d: ModuleType, place: str) -> None:
    all_seen = [seen(place, seed) for seed in (0, 1)]
    ends, label = (np.concatenate(parts) for parts in zip(*all_seen, strict=True))
    distance = np.linalg.norm(ends, axis=1)
    for kind in (TrackClass.PEDESTRIAN, TrackClass.CAR, TrackClass.BACKGROUND):
        assert (distance[label == kind] < 15).any()
        assert (distance[label == kind] > 15).any()
    assert distance.min() < 4
    sixth = np.floor(6 * (np.arctan2(ends[:, 1], ends[:, 0]) / (2 * np.pi) + 0.5)) % 6
    upright = ends[:, 2] > -0.8
    assert set(sixth[upright]) == set(range(6))


@pytest.mark.parametrize("place", PLACES)
def test_the_ground_is_under_the_sensor_and_nowhere_flat(open3d: ModuleType, place: str) -> None:
    ends, _ = seen(place, 0)
    below = np.hypot(ends[:, 0], ends[:, 1]) < 5
    ground = ends[below & (ends[:, 2] < -1.0)]
    assert abs(np.median(ground[:, 2]) + SENSOR.mounting_height) < 0.4
    plane = np.column_stack([ground[:, :2], np.ones(len(ground))])
    fitted, *_ = np.linalg.lstsq(plane, ground[:, 2], rcond=None)
    assert np.abs(ground[:, 2] - plane @ fitted).std() > 1e-3
