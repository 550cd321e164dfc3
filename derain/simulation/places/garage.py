"""A parking garage: a low ceiling with pipes and lamps, pillars, mesh, things near on all sides."""

from itertools import product

import numpy as np
from numpy.random import Generator

from derain.simulation import shapes
from derain.simulation.drawing import log_uniform
from derain.simulation.objects import Make, Options, Piece, Surfaces, of_size
from derain.simulation.places import ground, openwork, placing, plants, road_users, walls
from derain.simulation.places.walls import Walls
from derain.simulation.track import Track

# Least height of the ceiling, metres: sensors on a car's roof fit in.
LOWEST_CEILING = 2.9


def lay_out_garage(generator: Generator) -> Track:
    """Lays out a garage.

    A hall with rough walls, pillars and a ceiling under which pipes, cables, lamps and nets hang;
    cars with windows, people, bicycles, cages of mesh, railings, trolleys and dust sheets near on
    all sides, from 2 m on. A wall may be open to the outside, with a railing.
    """
    # From a private garage's yard to a whole storey.
    hall = Walls(
        (-generator.uniform(4, 25), generator.uniform(10, 45)),
        (-generator.uniform(4, 20), generator.uniform(4, 20)),
        generator.uniform(LOWEST_CEILING, 4.5),
        margin=0.7,
    )
    standing = [
        *_pillars(hall, generator),
        *_walls(hall, generator),
        *_parked(hall, generator),
        *_about(hall, generator),
        *_cages(hall, generator),
        *_under_the_ceiling(hall, generator),
    ]
    floor = ground.ground_mesh([ground.CONCRETE], ground.between(-np.inf, np.inf), generator)
    uneven = ground.Relief.draw(generator.uniform(0.003, 0.03), generator)
    length, width = hall.x[1] - hall.x[0], hall.y[1] - hall.y[0]
    rough = walls.rough_wall(length, width, generator, cell=0.6)
    ceiling = walls.laid_flat(rough, (hall.x[0], hall.y[0]), hall.height)
    return placing.assemble(floor, standing, uneven, generator, [ceiling])


def _under_the_ceiling(hall: Walls, generator: Generator) -> Surfaces:
    """Pipes, trays, lamps, and loose cables that hang down."""
    top = hall.height - 0.05
    for _ in range(generator.integers(3, 12)):
        radius, drop = log_uniform((0.008, 0.12), generator), generator.uniform(0.06, 0.35)
        if generator.random() < 0.5:
            y = generator.uniform(*hall.y)
            ends = (hall.x[0], y, top - drop), (hall.x[1], y, top - drop)
        else:
            x = generator.uniform(*hall.x)
            ends = (x, hall.y[0], top - drop), (x, hall.y[1], top - drop)
        yield openwork.made([shapes.bars([ends], radius, sides=6)], generator)
    for _ in range(generator.integers(3, 15)):
        at = generator.uniform(*hall.x), generator.uniform(*hall.y)
        heading = generator.uniform(0, np.pi)
        lamp = shapes.box(1.2, 0.12, top - 0.2, top - 0.12, at, heading)
        yield openwork.made([lamp], generator)
    for _ in range(generator.integers(0, 8)):
        start = np.array([generator.uniform(*hall.x), generator.uniform(*hall.y), top])
        end = start + generator.uniform((-2, -2, 0), (2, 2, 0))
        yield openwork.cable(start, end, generator.uniform(0.1, 0.9), (0.004, 0.03), generator)


def _pillars(hall: Walls, generator: Generator) -> Surfaces:
    bay = generator.uniform(4.5, 8)
    side, rounded = generator.uniform(0.25, 0.7), generator.random() < 0.3
    shift = generator.uniform(0, bay, 2)
    along = np.arange(hall.x[0] + shift[0], hall.x[1], bay)
    across = np.arange(hall.y[0] + shift[1], hall.y[1], bay)
    for at in product(along, across):
        if np.hypot(*at) > 2.6:
            box = shapes.box(side, side, 0, hall.height, at)
            pillar = shapes.cylinder(side / 2, 0, hall.height, at) if rounded else box
            yield openwork.made([pillar], generator)


def _walls(hall: Walls, generator: Generator) -> Surfaces:
    (behind, ahead), (right, left) = hall.x, hall.y
    for number, (x, y) in enumerate(hall.corners):
        length = (ahead - behind) if number % 2 == 0 else (left - right)
        is_open = generator.random() < 0.25
        sill = generator.uniform(0.3, 1.1) if is_open else hall.height
        wall = [walls.rough_wall(length, sill, generator, cell=0.3)]
        if is_open:
            wall.append(openwork.railing(length, generator))
            outside = plants.bush((0.5 * length, 1.5, 2.0), generator)
            wall.append(outside.placed(length / 2, -generator.uniform(3, 8)))
        yield from placing.place(wall, x, y, number * np.pi / 2)


def _parked(hall: Walls, generator: Generator) -> Surfaces:
    full = generator.uniform(0.2, 0.9)
    for y, nose in ((hall.y[0] + 3, 1), (hall.y[1] - 3, -1)):
        for x in np.arange(hall.x[0] + 2, hall.x[1] - 2, 2.7):
            if generator.random() < full and np.hypot(x, y) > 4.3:
                heading = nose * np.pi / 2 + generator.normal(0, 0.04)
                yield from placing.place(road_users.glazed_car(generator), x, y, heading)


def _about(hall: Walls, generator: Generator) -> Surfaces:
    """People and small things on the floor."""
    makes: list[Make] = [road_users.person] * int(generator.integers(3, 11))
    small: Options = [
        (road_users.cyclist, 1),
        (openwork.trolley, 2),
        (openwork.bollard, 1),
        (openwork.thin_pole, 3),
        (of_size(plants.brushwood, (0.3, 1.2)), 1),
        (ground.logs, 0.4),
        (of_size(ground.rubble, (0.3, 1)), 1),
    ]
    makes += placing.choose(small, (5, 20), generator)
    places = placing.free_places(len(makes), (2.2, 30), 0.9, generator, hall.holds)
    yield from placing.scatter(placing.shuffled(makes, generator), places, generator)


def _cages(hall: Walls, generator: Generator) -> Surfaces:
    """Walls of mesh, nets and railings that part the hall."""
    kinds: list[Piece] = [
        openwork.chain_link,
        openwork.railing,
        lambda length, drawn: openwork.net(length, hall.height - 0.1, drawn),
        openwork.scaffold,
    ]
    count = int(generator.integers(2, 6))
    for x, y in placing.free_places(count, (2.5, 20), 2.5, generator, hall.holds):
        make = kinds[generator.integers(len(kinds))]
        reach = min(generator.uniform(1.5, 7), hall.x[1] - x)
        pieces = placing.line_up(make, 0, (0, reach + 0.1), reach, generator)
        yield from placing.place(pieces, x, y)
