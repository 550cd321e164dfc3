"""Lays out test tracks at random: the street, and the rain facility, like REHEARSE's test track.

The surfaces of the facility reflect like matt materials in the near infrared. Their roughness and
their differences were chosen to match the known distribution of intensities, 0..255, in
REHEARSE-3D: the mean is about 23 and the standard deviation about 17, drops lie below about 10, and
hardly anything else lies below 13. These figures are deduced from the network published for
REHEARSE-3D: its first BatchNorm layer holds the moments of its training data, and it decides by
intensity. With them, this network finds the simulated rain.
`benchmarks/facility_observer.py` and `benchmarks/batchnorm_memory.py` show it.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.random import Generator

from derain.scan import Floats
from derain.simulation import objects
from derain.simulation.classes import TrackClass
from derain.simulation.objects import Surface, Surfaces
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
        *objects.sprinklers(_masts(generator), half_width + 0.5, generator),
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
        aside: Shift of the surfaces to the left, metres.
        heading: Angle by which they are turned first, radians from x towards y.
        slope: Rise of the ground per metre ahead and per metre to the left, (2,).
    """
    return Track.of(surface.placed(0, aside, heading).sloped(*slope) for surface in surfaces)


def road_and_ground(half_width: float, generator: Generator) -> Surfaces:
    """A road along x in patches, each dry or wet, and the ground on either side of it."""
    yield objects.ground((-10, 130), (-150, 150), generator)
    for x in pairwise([*np.arange(-10, 50, 1.5), 130]):
        yield objects.asphalt(x, (-half_width, 0), generator)
        yield objects.asphalt(x, (0, half_width), generator)


def _traffic(half_width: float, generator: Generator) -> Surfaces:
    fewer_than = {objects.car: 4, objects.pedestrian: 4, objects.bike: 3, objects.target: 4}
    kinds = [kind for kind, end in fewer_than.items() for _ in range(generator.integers(1, end))]
    # More places than things, and far enough apart that nothing stands inside a car.
    places = generator.permutation(np.arange(6.0, 66, 5))
    for kind, x in zip(kinds, places, strict=False):
        yield kind(generator).placed(x, generator.uniform(1 - half_width, half_width - 1))


def _masts(generator: Generator) -> Floats:
    return np.arange(generator.uniform(6, 12), 60, generator.uniform(6, 10))


def _verges(half_width: float, generator: Generator) -> Surfaces:
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


def _boughs(half_width: float, generator: Generator) -> Surfaces:
    for _ in range(generator.integers(5, 15)):
        x, y = generator.uniform(3, 15), generator.uniform(-half_width, half_width)
        yield objects.bough(1.5, generator).placed(x, y)


def _buildings(half_width: float, generator: Generator) -> Surfaces:
    for side in (-1, 1):
        for x in range(10, 110, 25):
            y = side * (half_width + generator.uniform(20, 50))
            yield objects.building(generator).placed(x, y)
    yield objects.building(generator).placed(generator.uniform(70, 110), generator.uniform(-20, 20))


# Road users, and the limits of their distances from the sensor, metres. In REHEARSE they stand at
# 10 to 112 m. The distances within these limits give every class about its share of the points in
# REHEARSE-3D.
# Source: REHEARSE-3D, section III.A.
ROAD_USERS: tuple[tuple[Callable[[Generator], Surface], tuple[float, float]], ...] = (
    (objects.car, (30, 80)),
    (objects.pedestrian, (35, 85)),
    (objects.pedestrian, (35, 85)),
    (objects.bike, (20, 55)),
    (objects.target, (20, 112)),
)

# Length of road that each of them has to itself, metres.
CLEARANCE = 6.0

# Where the masts stand, metres along the road: each carries three of the sprinklers that
# derain.simulation.rain_field has every 3 m.
MASTS = np.arange(16.0, 85, 9)

# Reflectivity at 900 nm: asphalt 0.17, smooth concrete 0.24, deciduous trees 0.6. How far it
# spreads about these values is a modelling choice: wet asphalt is darker, and a leaf often fills
# only a part of the beam. That there is no film of water that mirrors the light away, as on a
# street, is one too: the published network has seen next to nothing solid that is so dark.
# Source: Wehr and Lohr 1999, "Airborne laser scanning - an introduction and overview", its table of
#     typical reflectivities.
ASPHALT_REFLECTIVITY = (0.12, 0.20)
GROUND = (0.13, 0.27)
LEAVES = (0.03, 0.6)

# Roughness of the asphalt and of the ground, radians: a modelling choice. At a grazing angle they
# return 0.36 of their reflectivity, so a road of 0.17 measures 16 of 255 in every direction.
ROUGHNESS = 0.6


def lay_out_facility(generator: Generator) -> Track:
    """Lays out a facility.

    A road 6.8 to 7.6 m wide leads straight away from the sensor, turned by up to 2 degrees and
    sloping by up to 1 %. A car, two pedestrians, a bike and a target stand on it, with a row of
    sprinklers on each side. Bushes and the posts of a fence line it; trees and buildings close the
    view.
    """
    half_width = generator.uniform(3.4, 3.8)
    # Materials have a generator of their own, so that a seed's places stay where they are.
    (materials,) = generator.spawn(1)
    surfaces = [
        *(_paved(part, materials) for part in road_and_ground(half_width, generator)),
        *_road_users(half_width, generator),
        *objects.sprinklers(MASTS, half_width + 0.7, generator),
        *_facility_verges(half_width, generator, materials),
        *_horizon(half_width, generator, materials),
    ]
    heading = np.radians(generator.uniform(-2, 2))
    return on_slope(surfaces, 0, heading, generator.uniform(-0.01, 0.01, 2))


def _paved(surface: Surface, materials: Generator) -> Surface:
    span = ASPHALT_REFLECTIVITY if surface.label is TrackClass.ROAD else GROUND
    return replace(surface, reflectivity=materials.uniform(*span), roughness=ROUGHNESS)


def _foliage(
    radii: tuple[float, float, float], height: float, generator: Generator, materials: Generator
) -> Surface:
    foliage = objects.foliage(radii, height, generator)
    return replace(foliage, reflectivity=materials.uniform(*LEAVES, len(foliage.triangles)))


def _road_users(half_width: float, generator: Generator) -> Surfaces:
    taken = np.array([])
    for make, distances in ROAD_USERS:
        x = generator.uniform(*distances)
        while (np.abs(taken - x) < CLEARANCE).any():
            x = generator.uniform(*distances)
        taken = np.append(taken, x)
        yield make(generator).placed(x, generator.uniform(1.2 - half_width, half_width - 1.2))


def _facility_verges(half_width: float, generator: Generator, materials: Generator) -> Surfaces:
    for side in (-1, 1):
        for _ in range(generator.integers(10, 20)):
            radii = generator.uniform(0.3, 1.2, 3)
            x, y = generator.uniform(5, 40), side * (half_width + generator.uniform(2, 12))
            yield _foliage(tuple(radii), 0.7 * radii[2], generator, materials).placed(x, y)
        for x in np.arange(5.0, 100, 5):
            yield objects.pole(generator).placed(x, side * (half_width + 14))


def _horizon(half_width: float, generator: Generator, materials: Generator) -> Surfaces:
    for side in (-1, 1):
        for x in np.arange(30.0, 110, 10):
            y, crown = side * (half_width + generator.uniform(15, 40)), generator.uniform(1.5, 3)
            yield objects.trunk(generator).placed(x, y)
            tree = _foliage((crown, crown, crown), 2 + crown, generator, materials)
            yield tree.placed(x, y)
    for y in (-25, 25):
        yield objects.building(generator).placed(generator.uniform(85, 110), y)
