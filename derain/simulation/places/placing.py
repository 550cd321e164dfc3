"""Sets things up around the sensor: at random, side by side, along lines."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.random import Generator

from derain.scan import Floats
from derain.simulation import objects, shapes
from derain.simulation.drawing import Span, log_uniform
from derain.simulation.objects import Make, Options, Piece, Surface, Surfaces, Thing, of_size
from derain.simulation.places import ground, openwork, plants, road_users
from derain.simulation.places.ground import Relief
from derain.simulation.shapes import Place
from derain.simulation.track import Track

# Whether something may stand at an x and a y.
Allowed = Callable[[float, float], bool]

# Fewest, and one more than the most.
Counts = tuple[int, int]

# A line on the ground: its y at each x.
Line = Callable[[Floats], Floats]

# What stands in a place is farther from the sensor's axis, metres. Only the ground reaches it.
CLEARANCE = 1.6

# Half of the things are within this angle of straight ahead, degrees, where every sensor looks.
AHEAD = 55.0

PLACING_TRIES = 30


def anywhere(x: float, y: float) -> bool:
    """Allows every place."""
    return True


def free_places(
    count: int, distances: Span, apart: float, generator: Generator, allowed: Allowed = anywhere
) -> list[Place]:
    """Places about the sensor, as many within each doubling of the distance.

    Args:
        count: Number of things; fewer if there is no room for them.
        distances: Nearest and farthest, metres.
        apart: Least distance between two of them, metres.
        generator: Random generator.
        allowed: Function that allows places.
    """
    taken: list[Place] = []
    for number in range(count):
        for _ in range(PLACING_TRIES):
            distance = log_uniform(distances, generator)
            limit = AHEAD if number % 2 else 180.0
            azimuth = np.radians(generator.uniform(-limit, limit))
            x, y = distance * np.cos(azimuth), distance * np.sin(azimuth)
            if allowed(x, y) and all(np.hypot(x - a, y - b) > apart for a, b in taken):
                taken.append((x, y))
                break
    return taken


def scatter(makes: Iterable[Make], places: Iterable[Place], generator: Generator) -> Surfaces:
    """One thing at each place, turned at random.

    Args:
        makes: Function that makes each of them; those without a place are left out.
        places: Their places, metres.
        generator: Random generator.
    """
    for make, (x, y) in zip(makes, places, strict=False):
        heading = generator.uniform(-np.pi, np.pi)
        yield from place(make(generator), x, y, heading)


def shuffled(makes: Iterable[Make], generator: Generator) -> list[Make]:
    """Makers of things in another order."""
    ordered = list(makes)
    return [ordered[which] for which in generator.permutation(len(ordered))]


def place(thing: Thing, x: float, y: float, heading: float = 0.0) -> Surfaces:
    """A thing turned by a heading in radians, then moved to (x, y)."""
    for surface in [thing] if isinstance(thing, Surface) else thing:
        yield surface.placed(x, y, heading)


def line_up(
    make: Piece, line: Line | float, x: Span, piece: float, generator: Generator, gaps: float = 0.0
) -> Surfaces:
    """Pieces of a hedge, a fence or a wall, end to end along a line.

    Args:
        make: Makes a piece along x from the origin on, by its length in metres.
        line: The line; a number is the line along x at that y, metres.
        x: From where to where, metres.
        piece: Length of a piece, metres.
        generator: Random generator.
        gaps: Share of the pieces that is missing.
    """
    ends = np.arange(*x, piece)
    y = line(ends) if callable(line) else np.full(len(ends), float(line))
    for (before, after), (left, right) in zip(pairwise(ends), pairwise(y), strict=True):
        if generator.random() >= gaps:
            length = np.hypot(after - before, right - left)
            heading = np.arctan2(right - left, after - before)
            yield from place(make(length, generator), before, left, heading)


def choose(options: Options, count: int | Counts, generator: Generator) -> list[Make]:
    """So many of several makers of things, each with the probability of its share in the sum.

    Args:
        options: The makers and their shares.
        count: Number of things, or the limits between which it is drawn.
        generator: Random generator.
    """
    number = count if isinstance(count, int) else int(generator.integers(*count))
    makes, shares = zip(*options, strict=True)
    chosen = generator.choice(len(makes), number, p=np.array(shares) / np.sum(shares))
    return [makes[which] for which in chosen]


def assemble(
    ground: Iterable[Surface],
    standing: Iterable[Surface],
    relief: Relief,
    generator: Generator,
    over: Iterable[Surface] = (),
) -> Track:
    """A track of things laid out on a plane: cleared about the sensor, on uneven ground, tilted.

    Args:
        ground: The ground.
        standing: Object on it.
        relief: Its unevenness.
        generator: Random generator.
        over: Objects above the sensor: a ceiling, cables.
    """
    things = Track.of(standing)
    cleared = things.take(shapes.clear_of_axis(things.triangles, CLEARANCE))
    track = Track.joined([Track.of(ground), cleared]).with_surfaces(over)
    corners = track.triangles.reshape(-1, 3).astype(np.float64)
    corners[:, 2] += relief(corners[:, 0], corners[:, 1])
    tilted = (corners @ _tilt(generator)).reshape(-1, 3, 3)
    return replace(track, triangles=tilted.astype(np.float32))


def _tilt(generator: Generator) -> Floats:
    """Turns rows of coordinates by up to 9 degrees, and raises them by up to 2 % either way."""
    axes = np.eye(3)[:, None]
    turned = shapes.placed(axes, 0, 0, generator.uniform(-0.15, 0.15))
    tilted = shapes.sloped(turned, *generator.uniform(-0.02, 0.02, 2))
    return tilted[:, 0]


# How far from the sensor they are, metres.
NEAREST, FARTHEST = 2.2, 70.0


def users(
    generator: Generator, allowed: Allowed = anywhere, *, walkers: Counts, cars: Counts
) -> Surfaces:
    """People, up to four cyclists, and vehicles.

    Args:
        generator: Random generator.
        allowed: Function that allows places.
        walkers: Fewest people on foot, and one more than the most.
        cars: The same for vehicles; a few of them are lorries.
    """
    kinds: Options = [(road_users.glazed_car, 8), (objects.car, 2), (road_users.lorry, 1)]
    wheeled = choose(kinds, cars, generator)
    on_foot = choose([(road_users.person, 9), (objects.pedestrian, 1)], walkers, generator)
    bikes = choose([(road_users.cyclist, 9), (objects.bike, 1)], (1, 5), generator)
    parked = free_places(len(wheeled), (4.5, FARTHEST), 8.0, generator, allowed)

    def beside_them(x: float, y: float) -> bool:
        return allowed(x, y) and all(np.hypot(x - a, y - b) > 3.2 for a, b in parked)

    count = len(on_foot) + len(bikes)
    others = free_places(count, (NEAREST, FARTHEST), 1.0, generator, beside_them)
    yield from scatter(wheeled, parked, generator)
    yield from scatter(shuffled([*on_foot, *bikes], generator), others, generator)


def ragged_things(
    generator: Generator, allowed: Allowed = anywhere, *, count: Counts, leafy: bool = True
) -> Surfaces:
    """Bushes, brushwood, nets, pieces of fence, poles, grass, rubble, near the sensor and far.

    Args:
        generator: Random generator.
        allowed: Function that allows places.
        count: Fewest, and one more than the most.
        leafy: True if plants have leaves.
    """
    brushwood = of_size(plants.brushwood, (0.4, 2.5))
    things: Options = [
        (_bush if leafy else brushwood, 4),
        (brushwood, 4),
        (of_size(openwork.net, (1.5, 8), (1, 3.5)), 1.5),
        (of_size(openwork.chain_link, (2, 10)), 1),
        (of_size(openwork.railing, (1, 5)), 1),
        (openwork.thin_pole, 4),
        (_tufts, 3),
        (of_size(ground.rubble, (0.4, 2)), 1),
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
