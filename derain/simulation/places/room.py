"""Rooms: an office, hall or lab, a corridor, a staircase, with all that is near on every side."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from derain.simulation import shapes
from derain.simulation.objects import Surface
from derain.simulation.places import furniture, people, threads, walls
from derain.simulation.places.drawing import Span, evenly_in_logarithm
from derain.simulation.places.frames import Point, bars, made, railing
from derain.simulation.places.glass import pane
from derain.simulation.places.standing import Make, free_places, put, shared, strewn
from derain.simulation.track import Track

# Sensors that stand in a room are so high above its floor, metres.
MOUNTING_HEIGHTS = (0.3, 1.5)

# Nothing but the floor and the ceiling is nearer to the sensor's axis, metres.
CLEARANCE = 0.35

FLOOR = (0.03, 0.6)

# Of the bumps of a wall, what floors and ceilings have.
SMOOTH = 0.2

# Walls, floors and ceilings overlap by so much, metres: bumps leave no slit between them.
OVERLAP = 0.1


@dataclass(frozen=True)
class Walls:
    """Where the walls are, with the sensor at the origin.

    Attributes:
        x: From wall to wall along x, metres.
        y: From wall to wall along y, metres.
        height: Of the ceiling, metres.
    """

    x: Span
    y: Span
    height: float

    @classmethod
    def draw(cls, shortest: Span, longest: Span, generator: np.random.Generator) -> "Walls":
        """Draws walls by the spans of the length of the shorter side and of the longer one."""
        sides = [evenly_in_logarithm(span, generator) for span in (shortest, longest)]
        along, across = (sides[which] for which in generator.permutation(2))
        behind, right = (
            np.clip(generator.uniform(0, side), 0.7, side - 0.7) for side in (along, across)
        )
        return cls(
            (-float(behind), float(along - behind)),
            (-float(right), float(across - right)),
            generator.uniform(2.3, 4.5),
        )

    @property
    def corners(self) -> list[tuple[float, float]]:
        """Seen from above, around."""
        (behind, ahead), (right, left) = self.x, self.y
        return [(behind, right), (ahead, right), (ahead, left), (behind, left)]

    def holds(self, x: float, y: float) -> bool:
        """Whether a thing as large as a chair may stand there."""
        inside = self.x[0] + 0.35 < x < self.x[1] - 0.35
        return inside and self.y[0] + 0.35 < y < self.y[1] - 0.35


def lay_out_room(generator: np.random.Generator) -> Track:
    """Lays out a room in a building: mostly a furnished one, else a corridor or a staircase.

    Its walls, floor and ceiling are closed about the sensor, but for windows, glass and doors, with
    more walls behind. Tables, chairs, shelves, plants, machines, cables, lamps and people stand and
    hang from .4 m on.
    """
    kind = generator.choice(["furnished", "corridor", "stairs"], p=[0.7, 0.15, 0.15])
    if kind == "furnished":
        room = Walls.draw((2.5, 9.0), (3.0, 15.0), generator)
        standing = [*_furniture(room, generator), *_people(room, 6, generator)]
    elif kind == "corridor":
        room = Walls.draw((1.4, 2.6), (6.0, 40.0), generator)
        standing = [*_along_a_corridor(room, generator), *_people(room, 3, generator)]
    else:
        room = Walls.draw((2.5, 4.5), (4.0, 8.0), generator)
        room = replace(room, height=generator.uniform(4, 9))
        standing = [*_stairs(room, generator), *_people(room, 3, generator)]
    standing += [*_below_the_ceiling(room, generator)]
    shell = [*_floor_and_ceiling(room, generator), *_walls(room, generator)]
    cleared = [surface for surface in map(_cleared, standing) if len(surface.triangles)]
    heading = generator.uniform(-np.pi, np.pi)
    return Track.of(surface.placed(0, 0, heading) for surface in [*shell, *cleared])


def _moved(surface: Surface, x: float, y: float, z: float) -> Surface:
    return replace(surface, triangles=surface.triangles + np.array([x, y, z]))


def _cleared(surface: Surface) -> Surface:
    """A surface without what is too near to the sensor's axis."""
    x, y = shapes.nearest_to_axis(surface.triangles)
    far = (np.hypot(x, y) > CLEARANCE) & ~_about_axis(surface.triangles)
    reflectivity = np.broadcast_to(surface.reflectivity, len(far))[far]
    return replace(surface, triangles=surface.triangles[far], reflectivity=reflectivity)


def _about_axis(triangles: shapes.Triangles) -> NDArray[np.bool_]:
    """Whether the z axis goes through a triangle, bool (T,)."""
    first = triangles[..., :2]
    second = np.roll(first, -1, axis=1)
    turn = first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]
    through: NDArray[np.bool_] = (turn > 0).all(axis=1) | (turn < 0).all(axis=1)
    return through


def _floor_and_ceiling(room: Walls, generator: np.random.Generator) -> Iterator[Surface]:
    length, width = room.x[1] - room.x[0], room.y[1] - room.y[0]
    for height, bumps in ((0.0, SMOOTH), (room.height, -SMOOTH)):
        rough = walls.rough_wall(length + 2 * OVERLAP, width + 2 * OVERLAP, generator, cell=0.5)
        rough = _moved(rough, -OVERLAP, 0, -OVERLAP)
        x, bump, z = np.moveaxis(rough.triangles, -1, 0)
        lying = np.stack([x + room.x[0], z + room.y[0], height + bumps * bump], axis=-1)
        shine = evenly_in_logarithm(FLOOR, generator)
        yield replace(rough, triangles=lying, reflectivity=shine)


def _walls(room: Walls, generator: np.random.Generator) -> Iterator[Surface]:
    """Four walls, each whole, or with a band of glass or a doorway in it and a wall behind."""
    for number, (start, end) in enumerate(pairwise([*room.corners, room.corners[0]])):
        length = float(np.hypot(end[0] - start[0], end[1] - start[1]))
        kind = generator.choice(["whole", "glass", "doorway"], p=[0.5, 0.3, 0.2])
        if length < 1.5 or kind == "whole":
            whole = walls.rough_wall(length + 2 * OVERLAP, room.height, generator, cell=0.5)
            wall = [_moved(whole, -OVERLAP, 0, 0)]
        else:
            sill, lintel = (generator.choice([0.0, 0.9]), 2.1) if kind == "glass" else (0.0, 2.0)
            wide = length - 0.4 if kind == "glass" else 0.9
            wall = [*_pierced(length, room.height, (wide, sill, lintel), generator)]
            if kind == "glass":
                wall += [*_panes(length, (wide, sill, lintel), generator)]
            behind = walls.rough_wall(length + 8, room.height + 2, generator, cell=0.8)
            wall.append(_moved(behind, -4, -_beyond(generator), -1))
        wall += [*_on_the_wall(length, room.height, generator)]
        yield from put(wall, *start, number * np.pi / 2)


def _beyond(generator: np.random.Generator) -> float:
    """How far behind a window or a door the next wall is, metres."""
    return evenly_in_logarithm((1.0, 40.0), generator)


def _pierced(
    length: float,
    height: float,
    opening: tuple[float, float, float],
    generator: np.random.Generator,
) -> Iterator[Surface]:
    """A wall with an opening in the middle, by its width, lower and upper edge, and its frame."""
    wide, low, high = opening
    left, right = (length - wide) / 2, (length + wide) / 2
    pieces = [((0, left), (0, height)), ((right, length), (0, height))]
    pieces += [((left, right), (high, height)), ((left, right), (0, low))]
    shine = evenly_in_logarithm(walls.STONE, generator)
    for (begin, end), (bottom, top) in pieces:
        if top - bottom > 0.01:
            piece = walls.rough_wall(end - begin, top - bottom, generator, cell=0.5)
            yield replace(_moved(piece, begin, 0, bottom), reflectivity=shine)
    edges: list[tuple[Point, Point]] = [((x, 0, low), (x, 0, high)) for x in (left, right)]
    edges += [((left, 0, z), (right, 0, z)) for z in (low, high)]
    yield made([bars(edges, generator.uniform(0.02, 0.08))], generator)


def _panes(
    length: float, opening: tuple[float, float, float], generator: np.random.Generator
) -> Iterator[Surface]:
    """Glass in an opening, frames between the panes, blinds or a curtain before some of them."""
    wide, low, high = opening
    x = np.linspace((length - wide) / 2, (length + wide) / 2, 2 + int(wide / 1.4))
    for left, right in pairwise(x):
        corners = np.array([(left, 0, low), (right, 0, low), (right, 0, high), (left, 0, high)])
        yield made([pane(corners, generator)], generator)
        yield made([bars([((left, 0, low), (left, 0, high))], 0.03)], generator)
        if generator.random() < 0.2:
            slats = np.arange(low + generator.uniform(0, high - low - 0.2), high, 0.06)
            yield made(
                [bars([((left, 0.06, z), (right, 0.06, z)) for z in slats], 0.01)], generator
            )


def _on_the_wall(length: float, height: float, generator: np.random.Generator) -> Iterator[Surface]:
    """Pictures, boards, pipes, a radiator, coats on hooks, cables; the room lies at positive y."""
    for _ in range(generator.integers(0, 4)):
        x, z = generator.uniform(0, length), generator.uniform(0.8, 2.0)
        side, deep = generator.uniform(0.1, 0.9), generator.uniform(0.01, 0.15)
        yield made([shapes.placed(shapes.box(side, deep, z, z + 0.6 * side), x, 0.05)], generator)
    if generator.random() < 0.5:
        x = generator.uniform(0, length)
        radius = evenly_in_logarithm((0.008, 0.06), generator)
        yield made([bars([((x, 0.12, 0), (x, 0.12, height))], radius, 6)], generator)
    if generator.random() < 0.4 and length > 1.5:
        x = generator.uniform(0, length - 1) + np.arange(0, 1, 0.07)
        yield made([bars([((a, 0.1, 0.15), (a, 0.1, 0.75)) for a in x], 0.02)], generator)
    for _ in range(generator.integers(0, 3)):
        ends = np.column_stack(
            [generator.uniform(0, length, 2), (0.05, 0.05), generator.uniform(0.1, 2.2, 2)]
        )
        yield threads.cable(*ends, generator.uniform(0, 0.3), (0.004, 0.02), generator)


def _below_the_ceiling(room: Walls, generator: np.random.Generator) -> Iterator[Surface]:
    """Lamps on wires, pipes, trays, cables that hang down."""
    for _ in range(generator.integers(1, 8)):
        x, y = generator.uniform(*room.x), generator.uniform(*room.y)
        drop = generator.uniform(0.02, 0.35 * room.height)
        bottom = room.height - drop
        length, width = generator.uniform(0.1, 1.5), generator.uniform(0.06, 0.3)
        lamp = shapes.placed(shapes.box(length, width, bottom, bottom + 0.06), x, y)
        wires = [
            ((x + a * length, y, bottom), (x + a * length, y, room.height)) for a in (-0.4, 0.4)
        ]
        yield made([lamp, bars(wires, 0.004)], generator)
    for _ in range(generator.integers(0, 4)):
        y, z = generator.uniform(*room.y), room.height - generator.uniform(0.08, 0.5)
        radius = evenly_in_logarithm((0.01, 0.15), generator)
        yield made([bars([((room.x[0], y, z), (room.x[1], y, z))], radius, 6)], generator)
    for _ in range(generator.integers(0, 5)):
        start = np.array([generator.uniform(*room.x), generator.uniform(*room.y), room.height])
        end = start + generator.normal(0, (0.5, 0.5, 0.0))
        end[2] = generator.uniform(0.2, 1) * room.height
        yield threads.cable(start, end, generator.uniform(0, 0.3), (0.003, 0.015), generator)


def _furniture(room: Walls, generator: np.random.Generator) -> Iterator[Surface]:
    """Furniture, the more the larger the room, from bare to cluttered."""
    options: list[tuple[Make, float]] = [
        (furniture.table, 4),
        (furniture.chair, 6),
        (furniture.shelf, 3),
        (furniture.pot_plant, 1.5),
        (furniture.standing_lamp, 1.5),
        (furniture.machine, 2),
        (furniture.rubbish, 2),
        (_hung_net, 0.5),
    ]
    area = (room.x[1] - room.x[0]) * (room.y[1] - room.y[0])
    count = int(np.clip(area * evenly_in_logarithm((0.15, 0.9), generator), 3, 60))
    makes = shared(options, count, generator)
    places = free_places(count, (0.7, 15.0), 0.6, generator, room.holds)
    yield from strewn(makes, places, generator)


def _people(room: Walls, most: int, generator: np.random.Generator) -> Iterator[Surface]:
    """Somebody at an arm's length or at the other end of the room."""
    count = int(generator.integers(0, most))
    places = free_places(count, (0.6, 8.0), 0.5, generator, room.holds)
    yield from strewn([people.person] * count, places, generator)


def _hung_net(generator: np.random.Generator) -> Surface:
    """A curtain, a net or a drape."""
    return threads.net(generator.uniform(0.5, 2.5), generator.uniform(1.5, 2.3), generator)


def _along_a_corridor(room: Walls, generator: np.random.Generator) -> Iterator[Surface]:
    """Doors ajar with their handles, pipes, cabinets, and little else."""
    lengthwise = room.x[1] - room.x[0] > room.y[1] - room.y[0]
    ends, sides = (room.x, room.y) if lengthwise else (room.y, room.x)
    for at in np.arange(ends[0] + 0.5, ends[1] - 1, generator.uniform(2, 5)):
        side = sides[int(generator.integers(2))]
        ajar = generator.uniform(-0.2, 0.6)
        door = shapes.placed(shapes.box(0.9, 0.04, 0.01, 2.0), 0.45, 0, ajar)
        handle = shapes.placed(shapes.box(0.12, 0.03, 1.0, 1.03), 0.8, 0.06)
        x, y, heading = (at, side, 0.0) if lengthwise else (side, at, np.pi / 2)
        yield from put(made([door, handle], generator), float(x), float(y), heading)
    makes: list[Make] = [furniture.chair, furniture.rubbish, furniture.pot_plant, furniture.shelf]
    count = int(generator.integers(0, 8))
    chosen = shared([(make, 1) for make in makes], count, generator)
    yield from strewn(chosen, free_places(count, (0.8, 20), 1, generator, room.holds), generator)


def _stairs(room: Walls, generator: np.random.Generator) -> Iterator[Surface]:
    """A flight that rises from the sensor's floor, another above it, and their railings."""
    rise, tread, width = generator.uniform(0.15, 0.2), generator.uniform(0.25, 0.32), 1.2
    closed = generator.random() < 0.5
    for level, heading in ((0.0, 0.0), (12 * rise, np.pi)):
        steps = [
            shapes.placed(
                shapes.box(
                    tread,
                    width,
                    level + (n + 1) * rise - (rise if closed else 0.05),
                    level + (n + 1) * rise,
                ),
                tread * n,
                0,
            )
            for n in range(12)
        ]
        rail = railing(12 * tread, generator)
        parts = [
            made(steps, generator),
            *(
                replace(
                    rail,
                    triangles=shapes.raised(
                        shapes.sloped(_moved(rail, 0, y, 0).triangles, rise / tread, 0),
                        level + rise,
                    ),
                )
                for y in (-width / 2, width / 2)
            ),
        ]
        turned = -6 * tread if heading else 0.8
        yield from put(parts, turned * np.cos(heading), 0.6 * np.sign(heading), heading)
