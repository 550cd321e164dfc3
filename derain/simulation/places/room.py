"""Rooms: furnished ones, corridors, staircases, with all that is near on every side."""

from dataclasses import replace

import numpy as np
from numpy.random import Generator

from derain.simulation import shapes
from derain.simulation.classes import TrackClass
from derain.simulation.drawing import log_uniform
from derain.simulation.objects import Options, Surface, Surfaces, mirrored, of_size
from derain.simulation.places import openwork, placing, plants, road_users
from derain.simulation.places.openwork import made, railing
from derain.simulation.places.walls import Walls, shell
from derain.simulation.shapes import Point, Triangles, bars
from derain.simulation.track import Track

# Sensors that stand in a room are so high above its floor, metres.
MOUNTING_HEIGHTS = (0.3, 1.5)

# Nothing but the floor and the ceiling is nearer to the sensor's axis, metres.
ROOM_CLEARANCE = 0.35

# Share of the things that are polished, and of how many specks they are seen.
POLISHED = 0.12
SPECKS_OF_A_THING = (3.0, 150.0)


def lay_out_room(generator: Generator) -> Track:
    """Lays out a room in a building: mostly a furnished one, else a corridor or a staircase.

    Walls, floor and ceiling enclose the sensor, except for windows, glass and doors, with more
    walls behind. Tables, chairs, shelves, plants, machines, cables, lamps and people stand and
    hang from .4 m on.
    """
    kind = generator.choice(["furnished", "corridor", "stairs"], p=[0.7, 0.15, 0.15])
    if kind == "furnished":
        room = Walls.draw((2.5, 11.0), (4.0, 15.0), generator)
        standing = [*_furniture(room, generator), *_people(room, 6, generator)]
    elif kind == "corridor":
        room = Walls.draw((1.4, 2.6), (6.0, 40.0), generator)
        standing = [*_along_a_corridor(room, generator), *_people(room, 3, generator)]
    else:
        room = Walls.draw((2.5, 4.5), (4.0, 8.0), generator)
        room = replace(room, height=generator.uniform(4, 9))
        standing = [*_stairs(room, generator), *_people(room, 3, generator)]
    standing += [*_below_the_ceiling(room, generator)]
    cleared = [surface for surface in map(_cleared, standing) if len(surface.triangles)]
    cleared = [part for surface in cleared for part in _polished(surface, generator)]
    heading = generator.uniform(-np.pi, np.pi)
    surfaces = [*shell(room, generator), *cleared]
    return Track.of(surface.placed(0, 0, heading) for surface in surfaces)


def _cleared(surface: Surface) -> Surface:
    """A surface without its parts too near to the sensor's axis."""
    return surface.part(shapes.clear_of_axis(surface.triangles, ROOM_CLEARANCE))


def _polished(surface: Surface, generator: Generator) -> Surfaces:
    """The thing unchanged, or of polished metal, black glass or lacquer, seen in a few specks."""
    if generator.random() > POLISHED or surface.label != TrackClass.BACKGROUND:
        yield surface
        return
    count = round(log_uniform(SPECKS_OF_A_THING, generator))
    yield from mirrored(surface, np.array([0, 0, np.mean(MOUNTING_HEIGHTS)]), count, generator)


def _below_the_ceiling(room: Walls, generator: Generator) -> Surfaces:
    """Lamps on wires, pipes, trays, cables that hang down."""
    for _ in range(generator.integers(1, 8)):
        x, y = generator.uniform(*room.x), generator.uniform(*room.y)
        drop = generator.uniform(0.02, 0.35 * room.height)
        bottom = room.height - drop
        length, width = generator.uniform(0.1, 1.5), generator.uniform(0.06, 0.3)
        lamp = shapes.box(length, width, bottom, bottom + 0.06, at=(x, y))
        ends = x - 0.4 * length, x + 0.4 * length
        wires = [((end, y, bottom), (end, y, room.height)) for end in ends]
        yield made([lamp, shapes.bars(wires, 0.004)], generator)
    for _ in range(generator.integers(0, 4)):
        y, z = generator.uniform(*room.y), room.height - generator.uniform(0.08, 0.5)
        radius = log_uniform((0.01, 0.15), generator)
        pipe = (room.x[0], y, z), (room.x[1], y, z)
        yield made([shapes.bars([pipe], radius, sides=6)], generator)
    for _ in range(generator.integers(0, 5)):
        start = np.array([generator.uniform(*room.x), generator.uniform(*room.y), room.height])
        end = start + generator.normal(0, (0.5, 0.5, 0.0))
        end[2] = generator.uniform(0.2, 1) * room.height
        yield openwork.cable(start, end, generator.uniform(0, 0.3), (0.003, 0.015), generator)


def _furniture(room: Walls, generator: Generator) -> Surfaces:
    """Furniture, the more the larger the room, from bare to cluttered."""
    options: Options = [
        (table, 4),
        (chair, 6),
        (shelf, 3),
        (pot_plant, 1.5),
        (standing_lamp, 1.5),
        (machine, 2),
        (rubbish, 2),
        (of_size(openwork.net, (0.5, 2.5), (1.5, 2.3)), 0.7),
        (_twigs, 1.5),
    ]
    area = (room.x[1] - room.x[0]) * (room.y[1] - room.y[0])
    count = int(np.clip(area * log_uniform((0.08, 0.6), generator), 3, 40))
    makes = placing.choose(options, count, generator)
    places = placing.free_places(count, (0.7, 15.0), 0.6, generator, room.holds)
    yield from placing.scatter(makes, places, generator)


def _people(room: Walls, most: int, generator: Generator) -> Surfaces:
    """Somebody at an arm's length or at the other end of the room."""
    count = int(generator.integers(0, most))
    places = placing.free_places(count, (0.6, 8.0), 0.5, generator, room.holds)
    yield from placing.scatter([road_users.person] * count, places, generator)


def _twigs(generator: Generator) -> Surface:
    """Dry twigs, wires or tinsel on the floor or on a stand."""
    twigs = plants.brushwood(generator.uniform(0.2, 1.0), generator)
    return twigs.moved(0, 0, generator.choice([0.0, generator.uniform(0, 1)]))


def _along_a_corridor(room: Walls, generator: Generator) -> Surfaces:
    """Doors ajar with their handles, pipes, cabinets, and little else."""
    lengthwise = room.x[1] - room.x[0] > room.y[1] - room.y[0]
    ends, sides = (room.x, room.y) if lengthwise else (room.y, room.x)
    for at in np.arange(ends[0] + 0.5, ends[1] - 1, generator.uniform(2, 5)):
        side = sides[int(generator.integers(2))]
        ajar = generator.uniform(-0.2, 0.6)
        door = shapes.box(0.9, 0.04, 0.01, 2.0, at=(0.45, 0), heading=ajar)
        handle = shapes.box(0.12, 0.03, 1.0, 1.03, at=(0.8, 0.06))
        x, y, heading = (at, side, 0.0) if lengthwise else (side, at, np.pi / 2)
        yield from placing.place(made([door, handle], generator), x, y, heading)
    options: Options = [(chair, 1), (rubbish, 1), (pot_plant, 1), (shelf, 1)]
    chosen = placing.choose(options, (0, 8), generator)
    places = placing.free_places(len(chosen), (0.8, 20), 1, generator, room.holds)
    yield from placing.scatter(chosen, places, generator)


def _stairs(room: Walls, generator: Generator) -> Surfaces:
    """A flight that rises from the sensor's floor, another above it, and their railings."""
    rise, tread, width = generator.uniform(0.15, 0.2), generator.uniform(0.25, 0.32), 1.2
    closed = generator.random() < 0.5
    for level, heading in ((0.0, 0.0), (12 * rise, np.pi)):
        steps = []
        for number in range(12):
            top = level + (number + 1) * rise
            under = top - (rise if closed else 0.05)
            steps.append(shapes.box(tread, width, under, top, at=(tread * number, 0)))
        rail = railing(12 * tread, generator)
        parts = [made(steps, generator)]
        for y in (-width / 2, width / 2):
            rising = rail.moved(0, y, 0).sloped(rise / tread, 0)
            parts.append(rising.moved(0, 0, level + rise))
        turned = -6 * tread if heading else 0.8
        yield from placing.place(parts, turned * np.cos(heading), 0.6 * np.sign(heading), heading)


def table(generator: Generator) -> Surfaces:
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
        yield openwork.cable(start, start * (1, 1, 0.05), 0.1, (0.003, 0.01), generator)


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


def shelf(generator: Generator) -> Surfaces:
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


def pot_plant(generator: Generator) -> Surfaces:
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


def machine(generator: Generator) -> Surfaces:
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
        yield openwork.cable(start, end, generator.uniform(0, 0.2), (0.006, 0.04), generator)


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
