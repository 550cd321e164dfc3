"""Every place, as it is laid out and as a sensor sees it."""

from functools import cache
from types import ModuleType

import numpy as np
import pytest

from derain.cli.simulate import LAYOUT_NAMES
from derain.simulation.arrays import Floats, Ints
from derain.simulation.classes import TrackClass
from derain.simulation.layouts import LAYOUTS
from derain.simulation.places.horizon import lay_out_horizon
from derain.simulation.places.openwork import RETURNING, pane
from derain.simulation.sensor import Sensor
from derain.simulation.shapes import nearest_to_axis
from derain.simulation.track import Track

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
    return LAYOUTS[place](np.random.default_rng(seed))


@cache
def seen(place: str) -> tuple[Floats, Ints]:
    """Where the beams that return end as the sensor sees it, float64 (N, 3), and on what."""
    ends, labels = [], []
    for seed in (0, 1):
        returns = laid_out(place, seed).cast(SENSOR)
        ends.append((SENSOR.beams() * returns.range[:, None])[returns.returned])
        labels.append(returns.label[returns.returned])
    return np.concatenate(ends), np.concatenate(labels)


def test_the_command_knows_every_layout() -> None:
    assert set(LAYOUT_NAMES) == set(LAYOUTS)


@pytest.mark.parametrize("place", LAYOUTS)
def test_a_place_is_of_triangles_that_can_be_seen_and_another_by_another_seed(place: str) -> None:
    for seed in (0, 1):
        track = laid_out(place, seed)
        assert len(track.label) == len(track.triangles) == len(track.reflectivity) < 500_000
        assert np.isfinite(track.triangles).all()
        assert 0 < track.reflectivity.min() <= track.reflectivity.max() <= 1
        assert set(track.label) <= set(TrackClass) - {TrackClass.RAIN}
    assert len(laid_out(place, 0).label) != len(laid_out(place, 1).label)


def test_a_seed_gives_the_same_place_again() -> None:
    again = LAYOUTS["yard"](np.random.default_rng(0))
    assert np.array_equal(laid_out("yard", 0).triangles, again.triangles)
    assert np.array_equal(laid_out("yard", 0).reflectivity, again.reflectivity)


@pytest.mark.parametrize("place", ["street", "facility"])
def test_every_class_but_rain_stands_on_a_test_track(place: str) -> None:
    for seed in range(5):
        assert set(laid_out(place, seed).label) == set(TrackClass) - {TrackClass.RAIN}


@pytest.mark.parametrize("place", PLACES)
def test_people_cars_and_the_rest_are_near_and_all_around_but_not_at_the_sensor(
    open3d: ModuleType, place: str
) -> None:
    ends, label = seen(place)
    distance = np.linalg.norm(ends, axis=1)
    level = np.abs(ends[:, 2]) < 1.0  # neither the ground nor a ceiling
    assert distance[level].min() > CLEARANCE
    for kind in (TrackClass.PEDESTRIAN, TrackClass.CAR, TrackClass.BACKGROUND):
        assert (distance[label == kind] < 15).any()
        assert (distance[label == kind] > 15).any()
    assert distance.min() < 4
    sixth = np.floor(6 * (np.arctan2(ends[:, 1], ends[:, 0]) / (2 * np.pi) + 0.5)) % 6
    assert set(sixth[ends[:, 2] > -0.8]) == set(range(6))


@pytest.mark.parametrize("place", PLACES)
def test_the_ground_is_under_the_sensor_and_nowhere_flat(open3d: ModuleType, place: str) -> None:
    ends, _ = seen(place)
    below = np.hypot(ends[:, 0], ends[:, 1]) < 5
    ground = ends[below & (ends[:, 2] < -1.0)]
    assert abs(np.median(ground[:, 2]) + SENSOR.mounting_height) < 0.4
    plane = np.column_stack([ground[:, :2], np.ones(len(ground))])
    fitted, *_ = np.linalg.lstsq(plane, ground[:, 2], rcond=None)
    assert np.abs(ground[:, 2] - plane @ fitted).std() > 1e-3


def test_a_horizon_is_far_and_many_of_its_returns_are_by_themselves(open3d: ModuleType) -> None:
    sensor = Sensor(azimuth=(-180, 180), inclination=(-10, 10), columns=1440, maximum_range=300.0)
    far, alone = 0, 0
    for seed in range(4):
        track = Track.of(lay_out_horizon(np.random.default_rng(seed)))
        assert np.hypot(*nearest_to_axis(track.triangles.astype(float))).min() > 40
        returns = track.cast(sensor)
        returned = returns.power > sensor.detection_threshold
        far += ((returns.range > 150) & returned).sum()
        distance = np.where(returned, returns.range, 1e6).reshape(64, 1440)
        around = [np.roll(distance, step, axis) for axis in (0, 1) for step in (-1, 1)]
        gaps = np.min(np.abs(distance - np.stack(around)), axis=0)
        alone += (gaps[distance < 1e6] > 3).sum()
    assert far > 100
    assert alone > 100


def test_panes_lie_in_their_outline_and_return_the_stated_share_of_rays() -> None:
    corners = np.array([[0, 1, 0.5], [2, 1, 0.5], [2, 1, 1.5], [0, 1, 1.5]])
    shares = []
    for seed in range(200):
        triangles = pane(corners, np.random.default_rng(seed))
        assert (triangles.reshape(-1, 3) >= corners.min(axis=0) - 1e-9).all()
        assert (triangles.reshape(-1, 3) <= corners.max(axis=0) + 1e-9).all()
        edges = triangles[:, 1:] - triangles[:, :1]
        shares.append(np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1).sum() / 2 / 2)
    assert 0 < min(shares) < 3 * RETURNING[0]
    assert 0.7 * RETURNING[1] < max(shares) < 1.15 * RETURNING[1]
