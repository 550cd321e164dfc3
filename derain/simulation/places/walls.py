"""Walls as they are: rough, with windows, frames, sills, balconies, drain pipes and ivy."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.random import Generator

from derain.simulation import shapes
from derain.simulation.arrays import Floats
from derain.simulation.drawing import log_uniform
from derain.simulation.objects import Surface, of_material, spotted
from derain.simulation.places.frames import railing
from derain.simulation.places.threads import cable
from derain.simulation.shapes import Triangles, bars

GLASS_CELL = 0.04
MOST_CELLS = 900

# Share of a pane that returns a ray: of clean glass, and of a dirty or frosted pane.
RETURNING = (0.005, 0.6)


def pane(corners: Floats, generator: Generator) -> Triangles:
    """A pane of glass.

    Args:
        corners: Its four corners in order, (4, 3), metres.
        generator: Random generator.
    """
    sides = np.linalg.norm(corners[[1, 3]] - corners[0], axis=1)
    cell = max(GLASS_CELL, float(np.sqrt(sides.prod() / MOST_CELLS)))
    wide, high = (1 + int(side / cell) for side in sides)
    share = log_uniform(RETURNING, generator)
    # A pane is never nothing at all.
    there = generator.permutation(wide * high)[: 1 + generator.binomial(wide * high - 1, share)]
    column, row = there % wide, there // wide
    u, v = ((edge / count)[:, None] for edge, count in ((column, wide), (row, high)))
    ends = (0, 0), (1, 0), (1, 1), (0, 1)
    return shapes.quads(*(_between(corners, u + i / wide, v + j / high) for i, j in ends))


def _between(corners: Floats, u: Floats, v: Floats) -> Floats:
    """Places by their shares of the way from the first corner to the second and to the fourth."""
    first, second, third, fourth = corners
    lower, upper = (1 - u) * first + u * second, (1 - u) * fourth + u * third
    return np.asarray((1 - v) * lower + v * upper)


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


def laid_flat(
    wall: Surface, corner: tuple[float, float], height: float, bumps: float = 1.0
) -> Surface:
    """A rough wall laid down as a floor or as a ceiling.

    Args:
        wall: Its x and z become x and y.
        corner: The x and y of what was at its origin, metres.
        height: Of the floor or ceiling, metres.
        bumps: Factor of the bumps.
    """
    x, bump, z = np.moveaxis(wall.triangles, -1, 0)
    lying = np.stack([x + corner[0], z + corner[1], height + bumps * bump], axis=-1)
    return replace(wall, triangles=lying)


def facade(length: float, generator: Generator) -> Iterator[Surface]:
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
    assert not isinstance(wall.reflectivity, float)
    yield Surface(wall.triangles[solid], wall.label, wall.reflectivity[solid])
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
    yield from _on_the_wall(length, height, storey, generator)


def _on_the_wall(
    length: float, height: float, storey: float, generator: Generator
) -> Iterator[Surface]:
    """What hangs on a house: drain pipes, balconies, wires, ivy, an aerial."""
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
