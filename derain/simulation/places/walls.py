"""Walls: of houses, with windows and fixtures, and of rooms."""

from dataclasses import dataclass, replace
from itertools import pairwise, product

import numpy as np
from numpy.random import Generator

from derain.simulation import shapes
from derain.simulation.drawing import Span, log_uniform
from derain.simulation.objects import Surface, Surfaces, of_material, spotted
from derain.simulation.places.openwork import cable, made, pane, railing
from derain.simulation.places.placing import place
from derain.simulation.shapes import Place, Point, bars

STONE = (0.08, 0.7)
GLASS = (0.01, 0.2)


def rough_wall(length: float, height: float, generator: Generator, cell: float = 0.4) -> Surface:
    """A wall along x, from x = 0 on, with bumps from a millimetre to some centimetres.

    Args:
        length: Metres.
        height: Metres.
        generator: Random generator.
        cell: Between two corners of its mesh, metres.
    """
    x = np.linspace(0, length, 2 + int(length / cell))
    z = np.linspace(0, height, 2 + int(height / cell))
    corners = shapes.upright_grid(x, z)
    bumps = log_uniform((0.001, 0.05), generator)
    corners[..., 1] += bumps * generator.normal(size=corners.shape[:2])
    return spotted(shapes.sheet(corners), STONE, 0.15, generator)


def laid_flat(wall: Surface, corner: Place, height: float, bumps: float = 1.0) -> Surface:
    """A rough wall laid down as a floor or as a ceiling.

    Args:
        wall: Its x and z become x and y.
        corner: The x and y at which the wall's origin is placed, metres.
        height: Of the floor or ceiling, metres.
        bumps: Factor of the bumps.
    """
    x, bump, z = np.moveaxis(wall.triangles, -1, 0)
    lying = np.stack([x + corner[0], z + corner[1], height + bumps * bump], axis=-1)
    return replace(wall, triangles=lying)


def facade(length: float, generator: Generator) -> Surfaces:
    """A house's front along x, from x = 0 on, with rooms behind its windows; seen from -y."""
    storeys, storey = int(generator.integers(1, 5)), generator.uniform(2.6, 3.4)
    height, bay = storeys * storey, generator.uniform(1.8, 3.6)
    columns = max(1, int(length / bay))
    bay = length / columns
    wide, high, sill = 0.55 * bay, generator.uniform(1.0, 1.7), generator.uniform(0.7, 1.0)
    wall = rough_wall(length, height, generator)
    middle = wall.triangles.mean(axis=1)
    along, up = middle[:, 0] % bay - bay / 2, middle[:, 2] % storey - sill
    solid = (np.abs(along) > wide / 2) | (up < 0) | (up > high)
    yield wall.part(solid)
    behind = shapes.box(length, 2.5, 0, height, at=(length / 2, 2.75))  # the rooms' far walls
    yield of_material([behind], STONE, generator)
    panes, frames = [], []
    recess = generator.uniform(0.02, 0.25)
    for column, level in product(range(columns), range(storeys)):
        x, z = bay * (column + 0.5), storey * level + sill
        left, right, top = x - wide / 2, x + wide / 2, z + high
        square = [(left, recess, z), (right, recess, z), (right, recess, top), (left, recess, top)]
        panes.append(pane(np.array(square), generator))
        frames += list(zip(square, square[1:] + square[:1], strict=True))
        frames += [((x, recess, z), (x, recess, top)), ((left, -0.05, z), (right, -0.05, z))]
    yield of_material(panes, GLASS, generator)
    yield of_material([bars(frames, 0.03)], STONE, generator)
    yield from _on_the_front(length, height, storey, generator)


def _on_the_front(length: float, height: float, storey: float, generator: Generator) -> Surfaces:
    """Fixtures on the front of a house: drain pipes, balconies, wires, ivy, an aerial."""
    pipes = [((x, -0.1, 0), (x, -0.1, height)) for x in generator.uniform(0, length, 2)]
    yield of_material([bars(pipes, 0.05)], STONE, generator)
    if height > storey + 1 and generator.random() < 0.5:
        x, out = generator.uniform(0, 0.5 * length), 1.2
        slab = shapes.box(3, out, storey - 0.15, storey, at=(x + 1.5, -out / 2))
        rail = railing(3, generator)
        lifted = shapes.raised(shapes.placed(rail.triangles, x, -out), storey)
        yield of_material([slab, lifted], STONE, generator)
    start, end = (np.array([x, -0.15, 0.8 * height]) for x in (0, length))
    yield cable(start, end, 0.1, (0.005, 0.03), generator)
    if generator.random() < 0.4:
        leaves = generator.uniform((0, -0.3, 0), (0.4 * length, 0, 0.8 * height), (2500, 3))
        ivy = shapes.leaves(leaves, generator.uniform(0.015, 0.05), generator)
        yield of_material([ivy], STONE, generator)
    middle, rods = 0.5 * length, height + np.arange(1, 2, 0.25)
    aerial = [((middle, 1, height), (middle, 1, height + 2))]
    aerial += [((middle - 0.4, 1, z), (middle + 0.4, 1, z)) for z in rods]
    yield of_material([bars(aerial, 0.012)], STONE, generator)


FLOOR = (0.03, 0.6)

# Of the bumps of a wall, what floors and ceilings have.
SMOOTH = 0.2

# Walls, floors and ceilings overlap by so much, metres: bumps leave no slit between them.
OVERLAP = 0.1

# How far behind a window or a door the next wall is, metres.
BEYOND = (1.0, 40.0)


@dataclass(frozen=True)
class Walls:
    """The walls around the sensor, which is at the origin.

    Attributes:
        x: From wall to wall along x, metres.
        y: From wall to wall along y, metres.
        height: Of the ceiling, metres.
        margin: Least distance of the middle of a thing from the walls, metres.
    """

    x: Span
    y: Span
    height: float
    margin: float = 0.35

    @classmethod
    def draw(cls, shortest: Span, longest: Span, generator: Generator) -> "Walls":
        """Draws walls by the spans of the length of the shorter side and of the longer one."""
        sides = [log_uniform(span, generator) for span in (shortest, longest)]
        along, across = (sides[which] for which in generator.permutation(2))
        behind = float(np.clip(generator.uniform(0, along), 0.7, along - 0.7))
        right = float(np.clip(generator.uniform(0, across), 0.7, across - 0.7))
        x, y = (-behind, along - behind), (-right, across - right)
        return cls(x, y, generator.uniform(2.3, 4.5))

    @property
    def corners(self) -> list[Place]:
        """Seen from above, around."""
        (behind, ahead), (right, left) = self.x, self.y
        return [(behind, right), (ahead, right), (ahead, left), (behind, left)]

    def holds(self, x: float, y: float) -> bool:
        """True if there is room for a thing between the walls."""
        inside = self.x[0] + self.margin < x < self.x[1] - self.margin
        return inside and self.y[0] + self.margin < y < self.y[1] - self.margin


def shell(room: Walls, generator: Generator) -> Surfaces:
    """Floor, ceiling and walls, closed except for windows and doorways."""
    length, width = room.x[1] - room.x[0], room.y[1] - room.y[0]
    for height, bumps in ((0.0, SMOOTH), (room.height, -SMOOTH)):
        rough = rough_wall(length + 2 * OVERLAP, width + 2 * OVERLAP, generator, cell=0.5)
        rough = rough.moved(-OVERLAP, 0, -OVERLAP)
        lying = laid_flat(rough, (room.x[0], room.y[0]), height, bumps)
        yield replace(lying, reflectivity=log_uniform(FLOOR, generator))
    for number, (start, end) in enumerate(pairwise([*room.corners, room.corners[0]])):
        length = float(np.hypot(end[0] - start[0], end[1] - start[1]))
        kind = generator.choice(["whole", "glass", "doorway"], p=[0.5, 0.3, 0.2])
        if length < 1.5 or kind == "whole":
            whole = rough_wall(length + 2 * OVERLAP, room.height, generator, cell=0.5)
            wall = [whole.moved(-OVERLAP, 0, 0)]
        else:
            sill, lintel = (generator.choice([0.0, 0.9]), 2.1) if kind == "glass" else (0.0, 2.0)
            wide = length - 0.4 if kind == "glass" else 0.9
            wall = [*_pierced(length, room.height, (wide, sill, lintel), generator)]
            if kind == "glass":
                wall += [*_panes(length, (wide, sill, lintel), generator)]
            behind = rough_wall(length + 8, room.height + 2, generator, cell=0.8)
            wall.append(behind.moved(-4, -log_uniform(BEYOND, generator), -1))
        wall += [*_on_the_wall(length, room.height, generator)]
        yield from place(wall, *start, number * np.pi / 2)


def _pierced(
    length: float, height: float, opening: tuple[float, float, float], generator: Generator
) -> Surfaces:
    """A wall with an opening in the middle, by its width, lower and upper edge, and its frame."""
    wide, low, high = opening
    left, right = (length - wide) / 2, (length + wide) / 2
    pieces = [((0.0, left), (0.0, height)), ((right, length), (0.0, height))]
    pieces += [((left, right), (high, height)), ((left, right), (0.0, low))]
    shine = log_uniform(STONE, generator)
    for (begin, end), (bottom, top) in pieces:
        if top - bottom > 0.01:
            piece = rough_wall(end - begin, top - bottom, generator, cell=0.5)
            yield replace(piece.moved(begin, 0, bottom), reflectivity=shine)
    edges: list[tuple[Point, Point]] = [((x, 0, low), (x, 0, high)) for x in (left, right)]
    edges += [((left, 0, z), (right, 0, z)) for z in (low, high)]
    yield made([bars(edges, generator.uniform(0.02, 0.08))], generator)


def _panes(length: float, opening: tuple[float, float, float], generator: Generator) -> Surfaces:
    """Glass in an opening, frames between the panes, blinds or a curtain before some of them."""
    wide, low, high = opening
    x = np.linspace((length - wide) / 2, (length + wide) / 2, 2 + int(wide / 1.4))
    for left, right in pairwise(x):
        corners = np.array([(left, 0, low), (right, 0, low), (right, 0, high), (left, 0, high)])
        yield made([pane(corners, generator)], generator)
        yield made([bars([((left, 0, low), (left, 0, high))], 0.03)], generator)
        if generator.random() < 0.2:
            slats = np.arange(low + generator.uniform(0, high - low - 0.2), high, 0.06)
            ends = [((left, 0.06, z), (right, 0.06, z)) for z in slats]
            yield made([bars(ends, 0.01)], generator)


def _on_the_wall(length: float, height: float, generator: Generator) -> Surfaces:
    """Pictures, boards, pipes, a radiator, coats on hooks, cables; the room lies at positive y."""
    for _ in range(generator.integers(0, 4)):
        x, z = generator.uniform(0, length), generator.uniform(0.8, 2.0)
        side, deep = generator.uniform(0.1, 0.9), generator.uniform(0.01, 0.15)
        yield made([shapes.box(side, deep, z, z + 0.6 * side, at=(x, 0.05))], generator)
    if generator.random() < 0.5:
        x = generator.uniform(0, length)
        radius = log_uniform((0.008, 0.06), generator)
        yield made([bars([((x, 0.12, 0), (x, 0.12, height))], radius, 6)], generator)
    if generator.random() < 0.4 and length > 1.5:
        ribs = generator.uniform(0, length - 1) + np.arange(0, 1, 0.07)
        yield made([bars([((a, 0.1, 0.15), (a, 0.1, 0.75)) for a in ribs], 0.02)], generator)
    for _ in range(generator.integers(0, 3)):
        along, up = generator.uniform(0, length, 2), generator.uniform(0.1, 2.2, 2)
        start, end = np.column_stack([along, (0.05, 0.05), up])
        yield cable(start, end, generator.uniform(0, 0.3), (0.004, 0.02), generator)
