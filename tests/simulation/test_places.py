"""Every place, what is far away and what carries a sensor, as laid out and as a sensor sees it."""

from functools import cache

import numpy as np
import pytest

from derain.scan import Floats, Ints
from derain.simulation.classes import TrackClass
from derain.simulation.layouts import LAYOUTS
from derain.simulation.places.carrier import lay_out_carrier
from derain.simulation.places.horizon import lay_out_horizon
from derain.simulation.places.openwork import RETURNING, pane
from derain.simulation.places.room import MOUNTING_HEIGHTS, ROOM_CLEARANCE, lay_out_room
from derain.simulation.sensor import Sensor
from derain.simulation.shapes import clear_of_axis
from derain.simulation.track import Track

from .test_track import area

pytestmark = pytest.mark.usefixtures("open3d")

# A room is smaller than what is expected of the other places.
PLACES = sorted(set(LAYOUTS) - {"street", "facility", "room"})

# Nothing but the ground, and a ceiling, is nearer to the sensor's place, metres.
CLEARANCE = 1.5


def all_around(low: float, high: float, rows: int, columns: int, height: float) -> Sensor:
    """A sensor that sees a full circle between two inclinations."""
    return Sensor(
        azimuth=(-180, 180),
        inclination=(low, high),
        rows=rows,
        columns=columns,
        mounting_height=height,
        maximum_range=300.0,
    )


# From the height of a car's roof.
SENSOR = all_around(-30, 30, 32, 720, 1.6)


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


@pytest.mark.parametrize("place", LAYOUTS)
def test_a_place_is_of_triangles_that_can_be_seen_and_another_by_another_seed(place) -> None:
    for seed in (0, 1):
        track = laid_out(place, seed)
        assert len(track.label) == len(track.triangles) == len(track.reflectivity) < 500_000
        assert np.isfinite(track.triangles).all()
        assert 0 < track.reflectivity.min() <= track.reflectivity.max() <= 1
        classes = set(TrackClass) - {TrackClass.RAIN}
        assert set(track.label) <= classes
        assert set(track.label) == classes or place not in ("street", "facility")
    assert len(laid_out(place, 0).label) != len(laid_out(place, 1).label)


def test_a_seed_gives_the_same_place_again() -> None:
    again = LAYOUTS["yard"](np.random.default_rng(0))
    assert np.array_equal(laid_out("yard", 0).triangles, again.triangles)
    assert np.array_equal(laid_out("yard", 0).reflectivity, again.reflectivity)


@pytest.mark.parametrize("place", PLACES)
def test_people_cars_and_the_rest_are_near_and_all_around_but_not_at_the_sensor(place) -> None:
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
    # The ground is under the sensor, and nowhere flat.
    ground = ends[(np.hypot(ends[:, 0], ends[:, 1]) < 5) & (ends[:, 2] < -1.0)]
    assert abs(np.median(ground[:, 2]) + SENSOR.mounting_height) < 0.4
    plane = np.column_stack([ground[:, :2], np.ones(len(ground))])
    fitted, *_ = np.linalg.lstsq(plane, ground[:, 2], rcond=None)
    assert np.abs(ground[:, 2] - plane @ fitted).std() > 1e-3


def test_a_room_is_closed_about_the_sensor_and_near_and_has_people_in_it() -> None:
    shares, near, people = [], [], []
    for seed in range(12):
        room = lay_out_room(np.random.default_rng(seed))
        for height in MOUNTING_HEIGHTS:
            sensor = all_around(-89, 89, 60, 120, height)
            returns = room.cast(sensor)
            ends = sensor.beams() * returns.range[:, None]
            level = returns.returned & (np.abs(ends[:, 2]) < 0.2)
            assert np.hypot(ends[level, 0], ends[level, 1]).min() > ROOM_CLEARANCE - 0.01
            assert returns.range.min() > 0.2
            # The origin is on the floor.
            assert abs(np.median(returns.range[-120:]) - height) < 0.25
        shares.append(returns.returned.mean())
        near.append(np.median(returns.range[returns.returned]))
        people.append(returns.range[returns.label == TrackClass.PEDESTRIAN])
    assert np.min(shares) > 0.7  # through windows and glass
    assert np.median(shares) > 0.9
    assert np.max(shares) == 1
    assert np.median(near) < 4
    distance = np.concatenate(people)
    assert distance.min() < 1.5
    assert distance.max() > 3


def test_a_horizon_is_far_and_many_of_its_returns_are_by_themselves() -> None:
    sensor = all_around(-10, 10, 64, 1440, 1.3)
    far, alone = 0, 0
    for seed in range(4):
        track = Track.of(lay_out_horizon(np.random.default_rng(seed)))
        assert clear_of_axis(track.triangles, 40).all()
        returns = track.cast(sensor)
        returned = returns.power > sensor.detection_threshold
        far += ((returns.range > 150) & returned).sum()
        distance = np.where(returned, returns.range, 1e6).reshape(64, 1440)
        around = [np.roll(distance, step, axis) for axis in (0, 1) for step in (-1, 1)]
        gaps = np.min(np.abs(distance - np.stack(around)), axis=0)
        alone += (gaps[distance < 1e6] > 3).sum()
    assert far > 100
    assert alone > 100


@pytest.mark.parametrize("height", [0.5, 1.8, 5.0])
def test_a_carrier_is_near_and_dark_and_nowhere_nearer_than_a_tenth_of_a_metre(height) -> None:
    sensor, shares, seeds = all_around(-80, 60, 70, 360, height), [], 16
    for seed in range(seeds):
        surfaces = list(lay_out_carrier(np.random.default_rng(seed), height))
        if not surfaces:
            continue
        track = Track.of(surfaces)
        assert set(track.label) == {TrackClass.BACKGROUND}
        assert len(track.label) < 10_000
        assert np.hypot(*track.triangles[..., :2].reshape(-1, 2).T).max() < 5
        returns = track.cast(sensor)
        assert returns.range.min() > 0.1
        close = returns.range < 3
        assert close.any()
        shares.append((returns.power[close] >= sensor.detection_threshold).mean())
    # Mirrors hide much of what is behind some of them, and return next to nothing.
    assert np.mean(np.array(shares) > 0) > 0.5
    assert min(shares) < 0.1
    assert max(shares) > 0.3
    assert 0 < seeds - len(shares) < 0.5 * seeds  # some sensors see no carrier


def test_panes_lie_in_their_outline_and_return_the_stated_share_of_rays() -> None:
    corners = np.array([[0, 1, 0.5], [2, 1, 0.5], [2, 1, 1.5], [0, 1, 1.5]])
    shares = []
    for seed in range(200):
        triangles = pane(corners, np.random.default_rng(seed))
        assert (triangles.reshape(-1, 3) >= corners.min(axis=0) - 1e-9).all()
        assert (triangles.reshape(-1, 3) <= corners.max(axis=0) + 1e-9).all()
        shares.append(area(triangles) / 2)
    assert 0 < min(shares) < 3 * RETURNING[0]
    assert 0.7 * RETURNING[1] < max(shares) < 1.15 * RETURNING[1]
