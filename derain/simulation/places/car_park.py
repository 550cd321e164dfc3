"""A car park: rows of cars with windows, people among them, trolleys, bollards, lamps, hedges."""

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.random import Generator

from derain.simulation import objects
from derain.simulation.arrays import Floats, Ints
from derain.simulation.objects import Options, Piece, Surface
from derain.simulation.places import ground, openwork, placing, plants, road_users, walls
from derain.simulation.track import Track

# Rows of lots on either side of lanes, metres: how long a lot is, how wide, and a lane.
LOT_LENGTH, LOT_WIDTH, LANE = 5.2, 2.6, 6.5

# How far the car park reaches, metres along x and y.
HALF_SIZE = 38.0


def lay_out_car_park(generator: Generator) -> Track:
    """Lays out a car park.

    The sensor stands in a lane between rows of cars whose windows let most rays through. People,
    children among them, walk from 2 m on; trolleys, bollards, lamps and young trees stand between,
    snow or gravel is heaped up, hedges, fences and a house's front close it off.
    """
    winter = generator.random() < 0.35
    aside = generator.uniform(-0.2, 0.2) * LANE
    standing = [
        *_rows(aside, generator),
        *_people(aside, generator),
        *_between(aside, winter, generator),
        *_edge(winter, generator),
        *placing.ragged_things(generator, _far_off, count=(3, 10), leafy=not winter),
    ]
    uneven = ground.Relief.draw(generator.uniform(0.01, 0.12), generator)
    return placing.assemble(_ground(winter, generator), standing, uneven, generator)


def _far_off(x: float, y: float) -> bool:
    return bool(np.hypot(x, y) > 12)


def _ground(winter: bool, generator: Generator) -> Iterator[Surface]:
    surface = [ground.ASPHALT, ground.COBBLES, ground.TRACK][generator.choice(3, p=[0.6, 0.3, 0.1])]
    beyond = ground.SNOW if winter and generator.random() < 0.5 else ground.MEADOW

    def kind_at(x: Floats, y: Floats) -> Ints:
        return np.where(np.maximum(np.abs(x), np.abs(y)) < HALF_SIZE, 0, 1)

    yield from ground.ground_mesh([surface, beyond], kind_at, generator)


def _rows(aside: float, generator: Generator) -> Iterator[Surface]:
    """Cars in their lots, nose first or last, those far off of few triangles."""
    full = generator.uniform(0.3, 0.9)
    near_lane = aside + LANE / 2 + LOT_LENGTH / 2
    rows = [near_lane, near_lane + LOT_LENGTH + 0.3, near_lane + 2 * LOT_LENGTH + LANE + 0.3]
    rows += [2 * aside - y for y in rows]
    for y in rows:
        for x in np.arange(-HALF_SIZE + 4, HALF_SIZE - 4, LOT_WIDTH):
            if generator.random() < full and np.hypot(x, y) > 4.5:
                near = np.hypot(x, y) < 25
                make = road_users.glazed_car if near else objects.car
                heading = np.pi / 2 * generator.choice([-1, 1]) + generator.normal(0, 0.04)
                nudged = x + generator.normal(0, 0.12), y + generator.normal(0, 0.25)
                yield from placing.place(make(generator), *nudged, heading)


def _people(aside: float, generator: Generator) -> Iterator[Surface]:
    """People in the lanes and between cars, near and far, and a few who cycle."""

    def in_a_lane(x: float, y: float) -> bool:
        # The next lanes are beyond two rows.
        across = abs(y - aside) % (LANE + 2 * LOT_LENGTH + 0.3)
        return max(abs(x), abs(y)) < HALF_SIZE and across < LANE / 2 + 0.8

    for count, distances in (((6, 16), (2.2, 35)), (6, (15, 50))):
        makes = placing.choose([(road_users.person, 8), (road_users.cyclist, 1)], count, generator)
        places = placing.free_places(len(makes), distances, 0.9, generator, in_a_lane)
        yield from placing.scatter(makes, places, generator)


def _between(aside: float, winter: bool, generator: Generator) -> Iterator[Surface]:
    """Objects along the lane and between the lots."""
    kinds: Options = [
        (openwork.trolley, 2),
        (openwork.bollard, 2),
        (openwork.thin_pole, 2),
        (_sapling, 1),
    ]
    small = placing.shuffled(placing.choose(kinds, (8, 25), generator), generator)

    def at_its_edge(x: float, y: float) -> bool:
        return abs(x) < HALF_SIZE and abs(abs(y - aside) - LANE / 2 - 0.3) < 0.5

    places = placing.free_places(len(small), (2.2, 35), 0.5, generator, at_its_edge)
    yield from placing.scatter(small, places, generator)
    for x in np.arange(-HALF_SIZE, HALF_SIZE, generator.uniform(10, 20)):
        y = aside + LANE / 2 + LOT_LENGTH + 0.15
        yield from placing.place(plants.tree(winter, generator), x, y)
    if winter:
        bank = ground.bank(generator.uniform(4, 12), generator, snow=True)
        yield bank.placed(generator.uniform(3, 20), aside - LANE / 2 - 1)


def _edge(winter: bool, generator: Generator) -> Iterator[Surface]:
    """The boundary of the car park: on each of four sides a hedge, a fence, or houses."""
    makes: list[Piece] = [openwork.chain_link, openwork.railing, _nets, walls.facade]
    makes.append(_brushes if winter else plants.hedge)
    for quarter in range(4):
        make = makes[generator.integers(len(makes))]
        piece = 19.0 if make is walls.facade else 9.5
        for surface in placing.line_up(
            make, HALF_SIZE, (-HALF_SIZE, HALF_SIZE), piece, generator, 0.15
        ):
            yield surface.placed(0, 0, quarter * np.pi / 2)


def _nets(length: float, generator: Generator) -> Surface:
    return openwork.net(length, generator.uniform(1.5, 5), generator)


def _brushes(length: float, generator: Generator) -> Iterator[Surface]:
    for x in np.arange(0, length, 1.0):
        yield from placing.place(plants.brushwood(generator.uniform(0.8, 2), generator), x, 0)


def _sapling(generator: Generator) -> Iterable[Surface]:
    """A sapling tied to its stake."""
    yield openwork.thin_pole(generator)
    length, width, height = generator.uniform(0.2, 0.6, 3)
    leaves = plants.bush((length, width, height), generator)
    yield leaves.moved(0.1, 0, generator.uniform(0.8, 1.8))
