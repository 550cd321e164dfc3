"""People, vehicles and irregular things at all distances from the sensor."""

from collections.abc import Iterator

import numpy as np
from numpy.random import Generator

from derain.simulation import objects
from derain.simulation.objects import Options, Surface, of_size
from derain.simulation.places import frames, heaps, people, plants, threads, vehicles
from derain.simulation.places.placing import (
    Allowed,
    Counts,
    anywhere,
    choose,
    free_places,
    scatter,
    shuffled,
)

# How far from the sensor they are, metres.
NEAREST, FARTHEST = 2.2, 70.0


def users(
    generator: Generator, allowed: Allowed = anywhere, *, walkers: Counts, cars: Counts
) -> Iterator[Surface]:
    """People, up to four cyclists, and vehicles.

    Args:
        generator: Random generator.
        allowed: Where they may be.
        walkers: Fewest people on foot, and one more than the most.
        cars: The same of vehicles, of which few are lorries.
    """
    kinds: Options = [(vehicles.glazed_car, 8), (objects.car, 2), (vehicles.lorry, 1)]
    wheeled = choose(kinds, cars, generator)
    on_foot = choose([(people.person, 9), (objects.pedestrian, 1)], walkers, generator)
    bikes = choose([(people.cyclist, 9), (objects.bike, 1)], (1, 5), generator)
    parked = free_places(len(wheeled), (4.5, FARTHEST), 8.0, generator, allowed)

    def beside_them(x: float, y: float) -> bool:
        return allowed(x, y) and all(np.hypot(x - a, y - b) > 3.2 for a, b in parked)

    count = len(on_foot) + len(bikes)
    others = free_places(count, (NEAREST, FARTHEST), 1.0, generator, beside_them)
    yield from scatter(wheeled, parked, generator)
    yield from scatter(shuffled([*on_foot, *bikes], generator), others, generator)


def ragged_things(
    generator: Generator, allowed: Allowed = anywhere, *, count: Counts, leafy: bool = True
) -> Iterator[Surface]:
    """Bushes, brushwood, nets, pieces of fence, poles, grass, rubble, near the sensor and far.

    Args:
        generator: Random generator.
        allowed: Where they may be.
        count: Fewest, and one more than the most.
        leafy: Whether plants have leaves.
    """
    brushwood = of_size(plants.brushwood, (0.4, 2.5))
    things: Options = [
        (_bush if leafy else brushwood, 4),
        (brushwood, 4),
        (of_size(threads.net, (1.5, 8), (1, 3.5)), 1.5),
        (of_size(threads.chain_link, (2, 10)), 1),
        (of_size(frames.railing, (1, 5)), 1),
        (frames.thin_pole, 4),
        (_tufts, 3),
        (of_size(heaps.rubble, (0.4, 2)), 1),
        (plants.crowned_tree if leafy else plants.bare_tree, 1.5),
        (plants.bare_tree, 1),
    ]
    makes = choose(things, count, generator)
    places = free_places(len(makes), (2.5, 60.0), 0.6, generator, allowed)
    yield from scatter(makes, places, generator)


def _bush(generator: Generator) -> Surface:
    length, width, height = generator.uniform(0.2, 1.5, 3)
    return plants.bush((length, width, height), generator)


def _tufts(generator: Generator) -> Surface:
    spread = generator.uniform(0.3, 2.5)
    return plants.grass(generator.normal(0, spread, (generator.integers(5, 60), 2)), generator)
