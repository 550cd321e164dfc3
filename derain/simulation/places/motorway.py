"""A motorway: guard rails, gantries, noise walls, lorries, thin poles, embankments with scrub."""

import numpy as np
from numpy.random import Generator

from derain.simulation import objects, shapes
from derain.simulation.drawing import along
from derain.simulation.objects import Make, Piece, Surfaces
from derain.simulation.places import ground, openwork, placing, plants, road_users, walls
from derain.simulation.track import Track

MOTORWAY_SIGHT = (-80.0, 115.0)
LANE = 3.75


def lay_out_motorway(generator: Generator) -> Track:
    """Lays out a motorway.

    Two carriageways of two to four lanes with guard rails, cars and lorries in the lanes; gantries
    of lattice above, delineators and signs beside, noise walls, fences or scrub further out, and at
    times a breakdown: people and cones on the hard shoulder beside the sensor.
    """
    lanes = int(generator.integers(2, 5))
    own = int(generator.integers(lanes))
    left = (lanes - own - 0.5) * LANE + 0.8  # where the sensor's carriageway ends
    right = -(own + 0.5) * LANE - 2.5
    other = left + 3 + lanes * LANE
    standing = [
        *_rails((right - 0.5, left + 0.8, other + 1), generator),
        *_driving(lanes, own, left + 3, generator),
        *_breakdown(right, generator),
        *_beside((right, other), generator),
        *_embankments((right - 3, other + 3), generator),
        *placing.ragged_things(
            generator, lambda x, y: not right - 1 < y < other + 1.5, count=(5, 15)
        ),
    ]
    uneven = ground.Relief.draw(generator.uniform(0.02, 0.15), generator)
    over = _gantries((right - 1, other + 1), generator)
    return placing.assemble(_ground(right, other, generator), standing, uneven, generator, over)


def _ground(right: float, left: float, generator: Generator) -> Surfaces:
    verge = [ground.MEADOW, ground.GRAVEL, ground.SNOW][generator.choice(3, p=[0.6, 0.25, 0.15])]
    return ground.ground_mesh([ground.ASPHALT, verge], ground.between(right, left), generator)


def _rails(lines: tuple[float, ...], generator: Generator) -> Surfaces:
    for y in lines:
        make = openwork.guard_rail if generator.random() < 0.7 else openwork.wire_fence
        yield from placing.line_up(make, y, MOTORWAY_SIGHT, 16, generator, gaps=0.05)


def _driving(lanes: int, own: int, median: float, generator: Generator) -> Surfaces:
    """Cars and lorries in every lane, in the sensor's own at a distance."""
    for lane in range(2 * lanes):
        own_carriageway = lane < lanes
        y = (lane - own) * LANE if own_carriageway else median + (lane - lanes + 0.5) * LANE
        for x in along(*MOTORWAY_SIGHT, (14, 70), generator):
            if lane == own and abs(x) < 12:
                continue
            slow = lane in (0, 2 * lanes - 1)
            car = road_users.glazed_car if abs(x) < 35 else objects.car
            make: Make = road_users.lorry if generator.random() < 0.15 + 0.45 * slow else car
            heading = 0 if own_carriageway else np.pi
            yield from placing.place(make(generator), x, y + generator.normal(0, 0.2), heading)


def _breakdown(right: float, generator: Generator) -> Surfaces:
    """Objects on the hard shoulder and behind the rail: a waiting person, workers, cones, a car."""

    def on_the_shoulder(x: float, y: float) -> bool:
        return right - 2.5 < y < right + 2.3 and x < 60

    makes: list[Make] = [road_users.person] * int(generator.integers(2, 8))
    makes += [openwork.bollard] * int(generator.integers(0, 8))
    places = placing.free_places(len(makes), (2.3, 60), 1.2, generator, on_the_shoulder)
    yield from placing.scatter(makes, places, generator)


def _beside(edges: tuple[float, float], generator: Generator) -> Surfaces:
    """Delineators, signs, emergency telephones and lamps; weeds, and what lies on the shoulder."""
    for y, side in zip(edges, (-1, 1), strict=True):
        count = int(generator.integers(20, 300))
        ahead, out = generator.uniform(-30, 60, count), generator.exponential(1.5, count)
        yield plants.grass(np.column_stack([ahead, y + side * (out - 1)]), generator)
        for x in along(-30, 50, (5, 40), generator):
            litter = ground.rubble(generator.uniform(0.3, 1), generator)
            yield from placing.place(litter, x, y + side * generator.uniform(-1.5, 0.5))
        for x in along(*MOTORWAY_SIGHT, (4, 25), generator):
            pole = openwork.thin_pole(generator)
            yield from placing.place(pole, x, y + side * generator.uniform(0.8, 3))


def _gantries(edges: tuple[float, float], generator: Generator) -> Surfaces:
    """Girders of lattice across the road, with signs; now and then cables."""
    for x in along(12, 110, (25, 80), generator):
        height = generator.uniform(5.5, 7.5)
        right, left = edges[0] - 0.5, edges[1] + 0.5
        yield openwork.lattice((x, right, height), (x, left, height), 0.9, generator)
        for y in (right, left):
            yield openwork.lattice((x, y, 0), (x, y, height + 0.4), 0.5, generator)
        for y in generator.uniform(right + 2, left - 2, generator.integers(1, 4)):
            plate = shapes.box(0.1, generator.uniform(1.5, 3.5), 0, 2, at=(x - 0.6, y))
            yield openwork.made([shapes.raised(plate, height - 1)], generator)
    if generator.random() < 0.5:
        x, height = generator.uniform(5, 60), generator.uniform(9, 16)
        for lift in range(generator.integers(1, 5)):
            start, end = (np.array([x + 2 * lift, y, height + 0.6 * lift]) for y in (-60.0, 60.0))
            yield openwork.cable(start, end, generator.uniform(1, 3), (0.02, 0.06), generator)


def _embankments(edges: tuple[float, float], generator: Generator) -> Surfaces:
    """Beyond the road: a noise wall, a fence and scrub, or a bank with trees."""
    for y, side in zip(edges, (-1, 1), strict=True):
        make, out, piece, gaps = EMBANKMENTS[generator.integers(len(EMBANKMENTS))]
        away = y + side * generator.uniform(0.5, 4)
        line = away + out * side
        yield from placing.line_up(make, line, MOTORWAY_SIGHT, piece, generator, gaps)
        for x in along(*MOTORWAY_SIGHT, (5, 18), generator):
            y = away + side * generator.uniform(1, 12)
            yield from placing.place(plants.tree(generator.random() < 0.4, generator), x, y)
        for x in along(*MOTORWAY_SIGHT, (2, 12), generator):
            scrub = plants.brushwood(generator.uniform(0.5, 2.5), generator)
            yield from placing.place(scrub, x, away + side * generator.uniform(0.5, 6))


def _noise_wall(length: float, generator: Generator) -> Surfaces:
    height = generator.uniform(2, 5)
    yield walls.rough_wall(length, height, generator)
    post = (0, -0.1, 0), (0, -0.1, height + 0.1)
    yield openwork.made([shapes.bars([post], 0.12)], generator)


# What makes a piece of an embankment, how much farther out it stands and how long a piece is,
# metres, and the share of gaps.
EMBANKMENTS: tuple[tuple[Piece, float, float, float], ...] = (
    (_noise_wall, 0, 13, 0.05),
    (openwork.chain_link, 0, 13, 0.1),
    (ground.bank, 2, 10, 0.0),
)
