"""Lays out a test track at random: every seed gives another place of the same kind."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.random import Generator

from derain.simulation import objects, shapes
from derain.simulation.arrays import Floats
from derain.simulation.objects import Surface
from derain.simulation.track import Track


def lay_out_track(generator: Generator) -> Track:
    """Lays out a track.

    A road 6 to 12 m wide leads away from the sensor, turned by up to 6 degrees and sloping by up to
    4 %, with vehicles, people and targets on it, sprinklers along it, plants and posts beside it,
    boughs over it, and buildings behind. Patches of the road are wet whether it rains or not, and
    much of the foliage is near the sensor, so that a point is not rain merely because it is dark,
    near or in the air.
    """
    half_width = generator.uniform(3, 6)
    surfaces = [
        *road_and_ground(half_width, generator),
        *_traffic(half_width, generator),
        *_sprinklers(half_width, generator),
        *_verges(half_width, generator),
        *_boughs(half_width, generator),
        *_buildings(half_width, generator),
    ]
    aside, heading = generator.uniform(-2, 2), np.radians(generator.uniform(-6, 6))
    return on_slope(surfaces, aside, heading, generator.uniform(-0.04, 0.04, 2))


def on_slope(surfaces: Iterable[Surface], aside: float, heading: float, slope: Floats) -> Track:
    """Makes a track of surfaces that are laid out along x: turns, moves and tilts all of them.

    Args:
        surfaces: All that is on the track, at least one surface.
        aside: How far the surfaces are moved to the left, metres.
        heading: Angle by which they are turned first, radians from x towards y.
        slope: Rise of the ground per metre ahead and per metre to the left, (2,).
    """
    ahead, left = slope
    return Track.of(
        replace(surface, triangles=shapes.sloped(surface.triangles, ahead, left))
        for surface in (surface.placed(0, aside, heading) for surface in surfaces)
    )


def road_and_ground(half_width: float, generator: Generator) -> Iterator[Surface]:
    """A road along x in patches, each dry or wet, and the ground on either side of it."""
    yield objects.ground((-10, 130), (-150, 150), generator)
    for x in pairwise([*np.arange(-10, 50, 1.5), 130]):
        yield objects.asphalt(x, (-half_width, 0), generator)
        yield objects.asphalt(x, (0, half_width), generator)


def _traffic(half_width: float, generator: Generator) -> Iterator[Surface]:
    kinds = (
        [objects.car] * generator.integers(1, 4)
        + [objects.pedestrian] * generator.integers(1, 4)
        + [objects.bike] * generator.integers(1, 3)
        + [objects.target] * generator.integers(1, 4)
    )
    # More places than things, and far enough apart that nothing stands inside a car.
    places = generator.permutation(np.arange(6.0, 66, 5))
    for kind, x in zip(kinds, places, strict=False):
        yield kind(generator).placed(x, generator.uniform(1 - half_width, half_width - 1))


def _sprinklers(half_width: float, generator: Generator) -> Iterator[Surface]:
    x = np.arange(generator.uniform(6, 12), 60, generator.uniform(6, 10))
    return objects.sprinklers(x, half_width + 0.5, generator)


def _verges(half_width: float, generator: Generator) -> Iterator[Surface]:
    for side in (-1, 1):
        for _ in range(generator.integers(20, 40)):
            x, y = generator.uniform(3, 25), side * (half_width + generator.uniform(0, 8))
            length, width, height = generator.uniform(0.3, 2.0, 3)
            bush = objects.foliage((length, width, height), 0.7 * height, generator)
            yield bush.placed(x, y)
        for _ in range(generator.integers(2, 7)):
            x, y = generator.uniform(5, 60), side * (half_width + generator.uniform(2, 15))
            crown = generator.uniform(1, 3)
            yield from (part.placed(x, y) for part in objects.tree(crown, generator))
        for _ in range(generator.integers(5, 20)):
            x, y = generator.uniform(3, 50), side * (half_width + generator.uniform(0.5, 8))
            yield objects.pole(generator).placed(x, y)


def _boughs(half_width: float, generator: Generator) -> Iterator[Surface]:
    for _ in range(generator.integers(5, 15)):
        x, y = generator.uniform(3, 15), generator.uniform(-half_width, half_width)
        yield objects.bough(1.5, generator).placed(x, y)


def _buildings(half_width: float, generator: Generator) -> Iterator[Surface]:
    for side in (-1, 1):
        for x in range(10, 110, 25):
            y = side * (half_width + generator.uniform(20, 50))
            yield objects.building(generator).placed(x, y)
    yield objects.building(generator).placed(generator.uniform(70, 110), generator.uniform(-20, 20))
