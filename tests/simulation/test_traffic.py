"""Cars and pedestrians that move along, against and across a street."""

from itertools import combinations

import numpy as np
import pytest

from derain.errors import InputError
from derain.simulation.classes import TrackClass
from derain.simulation.street import Street
from derain.simulation.traffic import DRIVING, WALKING, WAYS, MovingThing, draw_traffic

from .moved import moved

TIMES = np.arange(20) / 10


def drawn(seed: int, count: int = 10, speed: float = 13.0) -> tuple[Street, list[MovingThing]]:
    generator = np.random.default_rng(seed)
    street = Street.draw(speed * TIMES[-1], generator)
    return street, draw_traffic(count, street, speed, TIMES, generator)


def corners(thing: MovingThing, time: float) -> np.ndarray:
    return moved(thing, time)[..., :2].reshape(-1, 2)


@pytest.mark.parametrize("seed", range(5))
def test_cars_drive_and_pedestrians_walk_along_against_and_across_the_street(seed: int) -> None:
    street, things = drawn(seed)
    kinds = {
        (thing.surface.label, abs(round(float(np.sign(thing.velocity.round(6)[1])))))
        for thing in things
    }
    both = TrackClass.CAR, TrackClass.PEDESTRIAN
    assert kinds == {(kind, across) for kind in both for across in (0, 1)}
    assert {np.sign(thing.velocity[0].round(6)) for thing in things} == {-1, 0, 1}
    for thing in things:
        car = thing.surface.label == TrackClass.CAR
        slowest, fastest = DRIVING if car else WALKING
        assert slowest <= np.linalg.norm(thing.velocity) <= fastest
        if car and abs(thing.velocity[0]) > 1:  # on the right of the street
            y = corners(thing, 0)[:, 1].mean()
            assert np.sign(y - street.axis) == -np.sign(thing.velocity[0])


def test_the_bounds_of_a_thing_are_where_its_velocity_takes_it() -> None:
    for thing in drawn(0)[1]:
        for time, (least, greatest) in zip(TIMES, thing.bounds(TIMES), strict=True):
            assert np.allclose(least, corners(thing, time).min(axis=0))
            assert np.allclose(greatest, corners(thing, time).max(axis=0))


@pytest.mark.parametrize("speed", [0.0, 13.0])
def test_nobody_runs_into_anybody_else_or_into_the_sensor(speed: float) -> None:
    for seed in range(5):
        _, things = drawn(seed, 15, speed)
        for time in TIMES:
            places = [corners(thing, time) for thing in things]
            sensor = np.array([[speed * time - 2.0, -0.8], [speed * time + 2.0, 0.8]])
            for one, two in combinations([*places, sensor], 2):
                apart = np.maximum(one.min(0) - two.max(0), two.min(0) - one.max(0))
                assert apart.max() > 0.5


def test_everybody_comes_near_the_sensor() -> None:
    _, things = drawn(3)
    for thing in things:
        distance = [
            np.linalg.norm(corners(thing, time) - (13 * time, 0), axis=1).min() for time in TIMES
        ]
        assert min(distance) < 90


def test_a_street_with_no_room_left_is_reported() -> None:
    with pytest.raises(InputError, match=r"traffic: the street has no room for 100\. Give \d+ or"):
        drawn(0, 100)


def test_traffic_comes_in_turn() -> None:
    _, few = drawn(4, 2)
    _, more = drawn(4, 2 + len(WAYS))
    for one, two in zip(few, more, strict=False):
        assert np.array_equal(one.surface.triangles, two.surface.triangles)
    assert more[len(WAYS)].surface.label == few[0].surface.label
