"""A city street: windows, parked cars and bicycles, people, trees, scaffolds, cables."""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from derain.simulation import objects
from derain.simulation.drawing import along
from derain.simulation.objects import Surfaces
from derain.simulation.places import ground, openwork, placing, plants, road_users, walls
from derain.simulation.track import Track

CITY_SIGHT = (-60.0, 85.0)


@dataclass(frozen=True)
class Section:
    """The section across a street, metres to the left of the sensor.

    Attributes:
        kerbs: Edges of the roadway, on the right and on the left; parked cars included.
        fronts: Begin of the houses.
    """

    kerbs: tuple[float, float]
    fronts: tuple[float, float]

    @classmethod
    def draw(cls, generator: Generator) -> "Section":
        """Draws a street of 8 to 14 m between pavements of 2 to 9 m."""
        kerbs = -generator.uniform(3.3, 5), generator.uniform(4.5, 9)
        right, left = generator.uniform(2, 9, 2)
        return cls(kerbs, (kerbs[0] - right, kerbs[1] + left))

    def on_the_road(self, x: float, y: float) -> bool:
        """True if a place is between the parked cars."""
        return self.kerbs[0] + 2.5 < y < self.kerbs[1] - 2.5

    def on_a_pavement(self, x: float, y: float) -> bool:
        """True if a place is between a kerb and the houses."""
        right = self.fronts[0] + 0.6 < y < self.kerbs[0] - 0.2
        return right or self.kerbs[1] + 0.2 < y < self.fronts[1] - 0.6


def lay_out_city(generator: Generator) -> Track:
    """Lays out a city street.

    Rough fronts with windows that rays go into, balconies, pipes and ivy; parked cars and bicycles;
    people on the pavements and across the road from 2 m on; trees, lamps, bollards, railings,
    scaffolds with nets, cables above.
    """
    section, winter = Section.draw(generator), generator.random() < 0.4
    standing = [
        *_houses(section, generator),
        *_parked(section, generator),
        *placing.users(generator, section.on_the_road, walkers=(2, 8), cars=(1, 5)),
        *_people(section, generator),
        *_furniture(section, winter, generator),
        *_works(section, generator),
        *placing.ragged_things(generator, section.on_a_pavement, count=(2, 12), leafy=not winter),
    ]
    uneven = ground.Relief.draw(generator.uniform(0.01, 0.1), generator)
    over = _cables(section, generator)
    return placing.assemble(_ground(section, generator), standing, uneven, generator, over)


def _ground(section: Section, generator: Generator) -> Surfaces:
    surface = ground.COBBLES if generator.random() < 0.25 else ground.ASPHALT
    right, left = section.kerbs
    return ground.ground_mesh([surface, ground.PAVING], ground.between(right, left), generator)


def _houses(section: Section, generator: Generator) -> Surfaces:
    for side, front in zip((-1, 1), section.fronts, strict=True):
        gaps, piece = generator.uniform(0, 0.3), generator.uniform(9, 18)
        for house in placing.line_up(walls.facade, abs(front), CITY_SIGHT, piece, generator, gaps):
            # Houses are seen from the street: those on the right are those on the left, turned.
            yield house if side > 0 else house.placed(CITY_SIGHT[0] + CITY_SIGHT[1], 0, np.pi)
    far = walls.facade(30, generator)
    yield from placing.place(far, CITY_SIGHT[1], 15, -np.pi / 2)


def _parked(section: Section, generator: Generator) -> Surfaces:
    for kerb, side in zip(section.kerbs, (-1, 1), strict=True):
        full = generator.uniform(0.1, 0.9)
        for x in along(*CITY_SIGHT, (5.8, 7.5), generator):
            y = kerb - side * 1.1 + generator.normal(0, 0.08)
            if generator.random() < full and np.hypot(x, y) > 3.9:
                make = road_users.glazed_car if abs(x) < 30 else objects.car
                heading = generator.normal(0, 0.03) + np.pi * generator.integers(2)
                yield from placing.place(make(generator), x, y, heading)


def _people(section: Section, generator: Generator) -> Surfaces:
    makes = placing.choose([(road_users.person, 8), (road_users.cyclist, 2)], 18, generator)
    count = int(generator.integers(4, 18))
    places = placing.free_places(count, (2.5, 55), 0.8, generator, section.on_a_pavement)
    yield from placing.scatter(makes, places, generator)


def _furniture(section: Section, winter: bool, generator: Generator) -> Surfaces:
    """Trees, lamps, signs, bollards and railings along the kerbs; bushes in tubs."""
    for kerb, side in zip(section.kerbs, (-1, 1), strict=True):
        for x in along(*CITY_SIGHT, (6, 30), generator):
            tree = plants.tree(winter, generator)
            yield from placing.place(tree, x, kerb + side * generator.uniform(0.5, 1))
        makes = placing.choose([(openwork.thin_pole, 3), (openwork.bollard, 2)], 40, generator)
        mixed, places = placing.shuffled(makes, generator), along(*CITY_SIGHT, (1, 7), generator)
        for make, x in zip(mixed, places, strict=False):
            yield from placing.place(make(generator), x, kerb + side * 0.35)
        if generator.random() < 0.4:
            begin = generator.uniform(2, 20)
            rail = openwork.railing(generator.uniform(3, 12), generator)
            yield rail.placed(begin, kerb + side * 0.4)


def _works(section: Section, generator: Generator) -> Surfaces:
    """A scaffold before a house, with or without a net."""
    if generator.random() < 0.5:
        side = int(generator.integers(2))
        length, x = generator.uniform(6, 15), generator.uniform(-5, 25)
        y = section.fronts[side] - (1.4 if side else -0.2)
        yield from placing.place(openwork.scaffold(length, generator), x, y)
        if generator.random() < 0.7:
            veil = openwork.net(length, generator.uniform(3, 6), generator)
            yield veil.placed(x, y - 0.15 if side else y + 1.3)


def _cables(section: Section, generator: Generator) -> Surfaces:
    """Cables from house to house, with lamps on them, and a tram's along the street."""
    if generator.random() < 0.6:
        height = generator.uniform(5, 7)
        for x in along(*CITY_SIGHT, (12, 30), generator):
            start, end = (np.array([x, y, height + 0.5]) for y in section.fronts)
            yield openwork.cable(start, end, 0.4, (0.006, 0.02), generator)
        for y in generator.uniform(-2, 4, generator.integers(0, 3)):
            start, end = (np.array([x, y, height]) for x in CITY_SIGHT)
            yield openwork.cable(start, end, 0.3, (0.008, 0.02), generator)
