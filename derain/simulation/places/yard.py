"""A yard or building site, all of ragged things: nets, scaffolds, rubble, scrub, mesh, logs."""

import numpy as np
from numpy.random import Generator

from derain.simulation.objects import Piece, Surface, Surfaces, of_size
from derain.simulation.places import ground, openwork, placing, plants, walls
from derain.simulation.track import Track


def lay_out_yard(generator: Generator) -> Track:
    """Lays out a yard.

    Nothing in it is smooth. On rough ground heaps of rubble, earth, snow and logs, scaffolds with
    torn nets, fences of mesh and wire, scrub and brambles up to the sensor, tufts of grass, cables
    strung above; people, bicycles and vehicles among them, from 2 m on.
    """
    winter = generator.random() < 0.4
    standing = [
        *placing.users(generator, walkers=(5, 14), cars=(1, 6)),
        *_heaps(winter, generator),
        *_lines(winter, generator),
        *_grass(generator),
        *placing.ragged_things(generator, count=(25, 60), leafy=not winter),
    ]
    uneven = ground.Relief.draw(generator.uniform(0.05, 0.4), generator)
    floor, over = _ground(winter, generator), _cables(generator)
    return placing.assemble(floor, standing, uneven, generator, over)


def _ground(winter: bool, generator: Generator) -> Surfaces:
    kinds = [ground.GRAVEL, ground.TRACK, ground.SNOW if winter else ground.MEADOW, ground.FIELD]
    chosen = [kinds[which] for which in generator.permutation(len(kinds))[:2]]
    patches = ground.Relief.draw(1, generator)
    return ground.ground_mesh(chosen, lambda x, y: (patches(x, y) > 0).astype(np.int64), generator)


def _heaps(winter: bool, generator: Generator) -> Surfaces:
    def mound(generator: Generator) -> Surface:
        length = generator.uniform(2, 8)
        return ground.bank(length, generator, snow=winter and generator.random() < 0.7)

    makes = [mound] * 4 + [of_size(ground.rubble, (0.5, 2.5))] * 6 + [ground.logs] * 3
    places = placing.free_places(int(generator.integers(4, 14)), (4, 40), 3, generator)
    yield from placing.scatter(placing.shuffled(makes, generator), places, generator)


def _lines(winter: bool, generator: Generator) -> Surfaces:
    """Fences, nets, scaffolds, hedges and walls, each a line somewhere, turned anyhow."""
    kinds: list[Piece] = [
        openwork.chain_link,
        openwork.wire_fence,
        openwork.railing,
        openwork.scaffold,
        lambda length, generator: openwork.net(length, generator.uniform(1, 5), generator),
        lambda length, generator: walls.rough_wall(length, generator.uniform(0.5, 4), generator),
    ]
    kinds.append(openwork.chain_link if winter else plants.hedge)
    for x, y in placing.free_places(int(generator.integers(4, 10)), (5, 45), 4, generator):
        make = kinds[generator.integers(len(kinds))]
        piece = generator.uniform(4, 9)
        reach = (0.0, piece * generator.integers(1, 4) + 0.1)
        line = placing.line_up(make, 0, reach, piece, generator, 0.1)
        # Across the way from the sensor to its beginning, so that it does not lead to the sensor.
        across = np.arctan2(y, x) + np.pi / 2 + generator.normal(0, 0.5)
        yield from placing.place(line, x, y, across)


def _grass(generator: Generator) -> Surfaces:
    for _ in range(generator.integers(1, 4)):
        count = int(generator.integers(100, 900))
        distance = placing.CLEARANCE + generator.exponential(generator.uniform(3, 9), count)
        angle = generator.uniform(0, 2 * np.pi, count)
        places = distance[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        yield plants.grass(places, generator)


def _cables(generator: Generator) -> Surfaces:
    for _ in range(generator.integers(0, 6)):
        height, x = generator.uniform(3, 7), generator.uniform(-10, 30)
        start, end = np.array([x, -25, height]), np.array([x + generator.normal(0, 15), 25, height])
        yield openwork.cable(start, end, generator.uniform(0.2, 1), (0.004, 0.03), generator)
