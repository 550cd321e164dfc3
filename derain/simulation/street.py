"""Lays out a street to drive along: as long as the drive and the sensor's sight need it.

The x axis runs along the sensor's lane, the origin lies under the first scan. The lane of oncoming
vehicles is on its left. On both sides follow parked cars, a pavement, a verge and houses.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.random import Generator

from derain.simulation import objects, shapes
from derain.simulation.classes import TrackClass
from derain.simulation.objects import Surface, Surfaces
from derain.simulation.shapes import Triangles

# How far the street goes on behind the first scan and ahead of the last, metres.
SIGHT = 120.0

# From the edge of the lanes outwards, metres: where cars are parked, where trees and lamps stand,
# where people walk, and where the verge begins.
PARKING = 2.3
KERB = PARKING + 0.8
PAVEMENT = KERB + 2.0

# Length of road that a parked car has to itself, metres.
LOT = 6.5

# Height of the pavement above the road, metres.
STEP = 0.12

# How far apart side streets are, and how far ahead of the last scan there is one, metres.
LENGTH_OF_BLOCK = (45.0, 70.0)
NEXT_JUNCTION = (14.0, 26.0)


@dataclass(frozen=True)
class Street:
    """The ground plan of a street.

    Attributes:
        length: Distance that the sensor drives, metres.
        lane: Width of each of the two lanes, metres.
        junctions: Positions of the axes of side streets, metres along x, ascending. Side streets
            are as wide as the street's two lanes, and their traffic crosses it.
    """

    length: float
    lane: float
    junctions: tuple[float, ...]

    @classmethod
    def draw(cls, length: float, generator: Generator) -> "Street":
        """Draws the plan of a street for a drive of a length in metres."""
        ahead = length + generator.uniform(*NEXT_JUNCTION)
        junctions = [ahead]
        while junctions[0] > -SIGHT:
            junctions.insert(0, junctions[0] - generator.uniform(*LENGTH_OF_BLOCK))
        while junctions[-1] < length + SIGHT:
            junctions.append(junctions[-1] + generator.uniform(*LENGTH_OF_BLOCK))
        return cls(length, generator.uniform(3.0, 3.75), tuple(junctions))

    @property
    def ends(self) -> tuple[float, float]:
        """Begin and end of the street, metres along x."""
        return -SIGHT, self.length + SIGHT

    @property
    def axis(self) -> float:
        """Position of its middle, metres to the left of the sensor's lane."""
        return self.lane / 2

    def beside(self, side: int, outwards: float) -> float:
        """The y of a place at a distance from the lanes, metres, on the left (1) or right."""
        return self.axis + side * (self.lane + outwards)

    def in_junction(self, triangles: Triangles) -> bool:
        """True if a thing reaches into a side street or the pavement along it."""
        x = triangles[..., 0]
        half = self.lane + PAVEMENT - PARKING
        return any(x.min() < middle + half and x.max() > middle - half for middle in self.junctions)


def lay_out_street(street: Street, generator: Generator) -> Surfaces:
    """Lays out the objects of a street.

    On both sides, all along and on both sides of its pavements: parked cars, bicycles, trees with
    low boughs, lamps, people who stand, bushes, posts and houses with gaps between them. The road
    is wet in patches. Nothing stands in the lanes, in the side streets or in the way of walkers.
    """
    yield from _ground(street, generator)
    for side in (-1, 1):
        for lay_out in (_parked, _pavement, _verge, _houses):
            for surface in lay_out(street, side, generator):
                if not street.in_junction(surface.triangles):
                    yield surface


def _ground(street: Street, generator: Generator) -> Surfaces:
    begin, end = street.ends
    yield objects.ground((begin, end), (-150, 150), generator)
    right, left = street.beside(-1, PARKING), street.beside(1, PARKING)
    for x in pairwise(np.arange(begin, end, 1.5)):
        yield objects.asphalt(x, (right, street.axis), generator)
        yield objects.asphalt(x, (street.axis, left), generator)
    for middle in street.junctions:
        across = middle - street.lane, middle + street.lane
        yield objects.asphalt(across, (-80, right), generator)
        yield objects.asphalt(across, (left, 80), generator)


def _parked(street: Street, side: int, generator: Generator) -> Surfaces:
    for x in np.arange(*street.ends, LOT):
        kind = generator.choice([0, 1, 2], p=[0.6, 0.32, 0.08])  # none, a car, a bicycle
        make = (None, objects.car, objects.bike)[kind]
        if make is not None:
            y = street.beside(side, PARKING / 2) + generator.uniform(-0.1, 0.1)
            heading = generator.normal(0, 0.03) + np.pi * generator.integers(2)
            yield make(generator).placed(x + generator.uniform(-0.4, 0.4), y, heading)


def _pavement(street: Street, side: int, generator: Generator) -> Surfaces:
    kerb = street.beside(side, (PARKING + KERB) / 2)
    half = street.lane + PAVEMENT - PARKING + 0.01
    middle, width = street.beside(side, (PARKING + PAVEMENT) / 2), PAVEMENT - PARKING
    for before, after in pairwise(street.junctions):
        slab = shapes.box(after - before - 2 * half, width, 0, STEP)
        stone = Surface(slab, TrackClass.BACKGROUND, generator.uniform(0.1, 0.35))
        yield stone.placed((before + after) / 2, middle)
    for x in _scattered(street, 0.12, generator):
        yield objects.pole(generator).placed(x, kerb)
    for x in _scattered(street, 0.1, generator):
        yield from _tree(x, kerb, generator)
    for x in _scattered(street, 0.2, generator):
        bough = objects.bough(1.2, generator)
        yield bough.placed(x, street.beside(side, generator.uniform(1.3, PAVEMENT)))
    for x in _scattered(street, 0.03, generator):
        y = street.beside(side, PAVEMENT + generator.uniform(0, 0.5))
        yield objects.pedestrian(generator).placed(x, y, generator.uniform(0, 2 * np.pi))


def _verge(street: Street, side: int, generator: Generator) -> Surfaces:
    for x in _scattered(street, 0.5, generator):
        length, width, height = generator.uniform(0.3, 1.5, 3)
        bush = objects.foliage((length, width, height), 0.7 * height, generator)
        yield bush.placed(x, street.beside(side, PAVEMENT + width + generator.uniform(0.6, 6)))
    for x in _scattered(street, 0.25, generator):
        y = street.beside(side, PAVEMENT + generator.uniform(0.6, 8))
        yield objects.pole(generator).placed(x, y)
    for x in _scattered(street, 0.06, generator):
        yield from _tree(x, street.beside(side, PAVEMENT + generator.uniform(2, 12)), generator)


def _houses(street: Street, side: int, generator: Generator) -> Surfaces:
    begin, end = street.ends
    while begin < end:
        house = objects.building(generator)
        length, width, _ = np.ptp(house.triangles, axis=(0, 1))
        front = PAVEMENT + generator.uniform(1, 14)
        yield house.placed(begin + length / 2, street.beside(side, front + width / 2))
        begin += length + generator.uniform(0.5, 12)


def _tree(x: float, y: float, generator: Generator) -> Surfaces:
    crown = generator.uniform(1, 2.5)
    yield from (part.placed(x, y) for part in objects.tree(crown, generator))


def _scattered(street: Street, per_metre: float, generator: Generator) -> Iterator[float]:
    """Places along the whole street, as many of them as Poisson's law gives, metres along x."""
    begin, end = street.ends
    count = generator.poisson(per_metre * (end - begin))
    yield from map(float, generator.uniform(begin, end, count))
