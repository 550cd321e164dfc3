"""What stands and hangs in rooms: tables, chairs, shelves, plants, cables, lamps, machines."""

from collections.abc import Iterator

import numpy as np
from numpy.random import Generator

from derain.simulation import shapes
from derain.simulation.drawing import log_uniform
from derain.simulation.objects import Surface
from derain.simulation.places import plants, threads
from derain.simulation.places.frames import made
from derain.simulation.shapes import Point, Triangles, bars


def table(generator: Generator) -> Iterator[Surface]:
    """A table on four legs or a trestle, scatter with papers, screens, cups and cables."""
    length, width = generator.uniform(0.6, 2.2), generator.uniform(0.5, 1.0)
    top = generator.uniform(0.65, 1.05)
    yield made([shapes.box(length, width, top - 0.03, top)], generator)
    x, y = 0.46 * length, 0.44 * width
    feet = [(i * x, j * y) for i in (-1, 1) for j in (-1, 1)]
    rods: list[tuple[Point, Point]] = [((a, b, 0), (a, b, top)) for a, b in feet]
    if generator.random() < 0.5:
        rods += [((-x, -y, 0.3), (-x, y, 0.3)), ((x, -y, 0.3), (x, y, 0.3))]
    yield made([bars(rods, log_uniform((0.01, 0.04), generator))], generator)
    for _ in range(generator.integers(0, 9)):
        at_x, at_y = generator.uniform((-x, -y), (x, y))
        thing = _small_thing(top, generator)
        yield made([shapes.placed(thing, at_x, at_y, generator.uniform(0, np.pi))], generator)
    if generator.random() < 0.5:
        start = np.array([generator.uniform(-x, x), -y, top])
        yield threads.cable(start, start * (1, 1, 0.05), 0.1, (0.003, 0.01), generator)


def chair(generator: Generator) -> Surface:
    """A chair with legs of tube or on a star of castors, its back closed or of bars."""
    seat, half = generator.uniform(0.4, 0.6), generator.uniform(0.17, 0.25)
    back, radius = seat + generator.uniform(0.3, 0.6), log_uniform((0.007, 0.02), generator)
    parts = [shapes.box(2 * half, 2 * half, seat - 0.04, seat)]
    if generator.random() < 0.5:
        corners = [(i * half, j * half) for i in (-1, 1) for j in (-1, 1)]
        rods = [((x, y, 0.0), (0.9 * x, 0.9 * y, seat)) for x, y in corners]
    else:
        angle = np.arange(5) * 0.4 * np.pi
        rods = [((0, 0, 0.12), (0.32 * np.cos(a), 0.32 * np.sin(a), 0.05)) for a in angle]
        rods.append(((0, 0, 0.1), (0, 0, seat)))
    if generator.random() < 0.5:
        parts.append(shapes.box(0.03, 2 * half, seat + 0.1, back, at=(-half, 0)))
    else:
        rods += [((-half, y, seat), (-half - 0.06, y, back)) for y in np.linspace(-half, half, 4)]
    return made([*parts, bars(rods, radius)], generator)


def shelf(generator: Generator) -> Iterator[Surface]:
    """Boards between uprights, full of books, boxes, folders and gaps of all depths."""
    length, depth = generator.uniform(0.6, 2.5), generator.uniform(0.25, 0.6)
    boards = np.arange(0.1, generator.uniform(0.9, 2.3), generator.uniform(0.28, 0.5))
    half, top = length / 2, float(boards[-1])
    wood = [shapes.box(length, depth, z - 0.02, z) for z in boards]
    ends = [(x, y) for x in (-half, half) for y in (-depth / 2, depth / 2)]
    wood.append(bars([((x, y, 0), (x, y, top)) for x, y in ends], generator.uniform(0.01, 0.03)))
    yield made(wood, generator)
    full = generator.uniform(0.3, 0.95)
    for z in boards[:-1]:
        x = -half
        while x < half - 0.05:
            width, height = (log_uniform((0.02, 0.4), generator), generator.uniform(0.05, 0.27))
            deep = generator.uniform(0.3, 1) * depth
            if generator.random() < full:
                at = x + width / 2, generator.normal(0, 0.1 * depth)
                yield made([shapes.box(width, deep, z, z + height, at)], generator)
            x += width + generator.choice([0.0, 0.01, 0.1])


def pot_plant(generator: Generator) -> Iterator[Surface]:
    """A plant of leaves or of long blades in a pot."""
    height, radius = generator.uniform(0.15, 0.5), generator.uniform(0.08, 0.25)
    yield made([shapes.cylinder(radius, 0, height)], generator)
    size = generator.uniform(0.2, 0.8)
    if generator.random() < 0.5:
        leaves = plants.bush((0.5 * size, 0.5 * size, 0.7 * size), generator)
    else:
        leaves = plants.brushwood(size, generator)
    yield leaves.moved(0, 0, height)


def standing_lamp(generator: Generator) -> Surface:
    """A lamp, a coat stand, a microphone or a flag on a thin pole."""
    height, radius = generator.uniform(1.0, 2.0), log_uniform((0.006, 0.03), generator)
    parts = [bars([((0, 0, 0), (0, 0, height))], radius, 6), shapes.cylinder(0.15, 0, 0.03)]
    if generator.random() < 0.6:
        parts.append(shapes.cylinder(generator.uniform(0.08, 0.25), height, height + 0.2))
    arms = [
        ((0.0, 0.0, height - 0.1), (0.25 * np.cos(a), 0.25 * np.sin(a), height))
        for a in generator.uniform(0, 2 * np.pi, generator.integers(0, 6))
    ]
    return made([*parts, bars(arms, radius)] if arms else parts, generator)


def machine(generator: Generator) -> Iterator[Surface]:
    """A machine of a lab: boxes on each other, pipes, a hood, hoses."""
    length, width = generator.uniform(0.4, 1.5, 2)
    top = 0.0
    for _ in range(generator.integers(1, 4)):
        height = generator.uniform(0.2, 0.7)
        x, y = generator.normal(0, 0.08, 2)
        yield made([shapes.box(length, width, top, top + height, at=(x, y))], generator)
        top += height
        length, width = length * generator.uniform(0.5, 1), width * generator.uniform(0.5, 1)
    for _ in range(generator.integers(0, 5)):
        start = np.array([*generator.uniform(-0.4, 0.4, 2), generator.uniform(0.1, top)])
        end = start + generator.normal(0, 0.4, 3)
        end[2] = abs(end[2])
        yield threads.cable(start, end, generator.uniform(0, 0.2), (0.006, 0.04), generator)


def rubbish(generator: Generator) -> Surface:
    """Boxes, bags and a bucket on the floor, one leaning on the other."""
    parts = []
    for _ in range(generator.integers(1, 6)):
        length, width, height = generator.uniform(0.1, 0.5, 3)
        x, y = generator.normal(0, 0.35, 2)
        block = shapes.sloped(shapes.box(length, width, 0, height), *generator.normal(0, 0.2, 2))
        parts.append(shapes.placed(block, x, y, generator.uniform(0, np.pi)))
    return made(parts, generator)


def _small_thing(top: float, generator: Generator) -> Triangles:
    """A screen on its foot, a cup, a book, a tablet on edge, something bent."""
    kind = generator.integers(4)
    if kind == 0:
        wide = generator.uniform(0.3, 0.7)
        screen = shapes.box(0.03, wide, top + 0.1, top + 0.1 + 0.6 * wide)
        return np.concatenate([screen, shapes.box(0.05, 0.05, top, top + 0.12)])
    if kind == 1:
        height = generator.uniform(0.06, 0.3)
        return shapes.cylinder(generator.uniform(0.02, 0.06), top, top + height)
    if kind == 2:
        length, width, height = generator.uniform((0.1, 0.1, 0.01), (0.4, 0.3, 0.15))
        return shapes.box(length, width, top, top + height)
    starts = np.tile([0.0, 0.0, top], (12, 1))
    ends = starts + np.abs(generator.normal(0, 0.12, (12, 3))) * (1, 1, 2)
    return shapes.blades(starts, ends, 0.01, generator)
