"""Walls as they are: rough, with windows, frames, sills, balconies, drain pipes and ivy."""

from collections.abc import Iterator

import numpy as np

from derain.simulation import shapes
from derain.simulation.classes import TrackClass
from derain.simulation.drawing import log_uniform
from derain.simulation.objects import Surface
from derain.simulation.places.frames import bars, railing
from derain.simulation.places.glass import pane
from derain.simulation.places.threads import cable

STONE = (0.08, 0.7)
GLASS = (0.01, 0.2)


def rough_wall(
    length: float, height: float, generator: np.random.Generator, cell: float = 0.4
) -> Surface:
    """A wall along x, from x = 0 on, with bumps from a millimetre to some centimetres.

    Args:
        length: Metres.
        height: Metres.
        generator: Random generator.
        cell: Between two corners of its mesh, metres.
    """
    x = np.linspace(0, length, 2 + int(length / cell))
    z = np.linspace(0, height, 2 + int(height / cell))
    corners = np.stack(np.meshgrid(x, 0.0, z, indexing="ij"), axis=-1)[:, 0]
    bumps = log_uniform((0.001, 0.05), generator)
    corners[..., 1] += bumps * generator.normal(size=corners.shape[:2])
    stones = log_uniform(STONE, generator)
    triangles = shapes.sheet(corners)
    reflectivity = stones * np.exp(generator.normal(0, 0.15, len(triangles)))
    return Surface(triangles, TrackClass.BACKGROUND, np.clip(reflectivity, 0.003, 1))


def facade(length: float, generator: np.random.Generator) -> Iterator[Surface]:
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
    yield _thing([_box((0, length), (1.5, 4), (0, height))], generator)  # the rooms' far walls
    corners = [
        (bay * (column + 0.5), storey * level + sill)
        for column in range(columns)
        for level in range(storeys)
    ]
    panes, frames = [], []
    recess = generator.uniform(0.02, 0.25)
    for x, z in corners:
        left, right, top = x - wide / 2, x + wide / 2, z + high
        square = [(left, recess, z), (right, recess, z), (right, recess, top), (left, recess, top)]
        panes.append(pane(np.array(square), generator))
        frames += list(zip(square, square[1:] + square[:1], strict=True))
        frames += [((x, recess, z), (x, recess, top)), ((left, -0.05, z), (right, -0.05, z))]
    yield Surface(np.concatenate(panes), TrackClass.BACKGROUND, log_uniform(GLASS, generator))
    yield _thing([bars(frames, 0.03)], generator)
    yield from _on_the_wall(length, height, storey, generator)


def _on_the_wall(
    length: float, height: float, storey: float, generator: np.random.Generator
) -> Iterator[Surface]:
    """What hangs on a house: drain pipes, balconies, wires, ivy, an aerial."""
    pipes = [((x, -0.1, 0), (x, -0.1, height)) for x in generator.uniform(0, length, 2)]
    yield _thing([bars(pipes, 0.05)], generator)
    if height > storey + 1 and generator.random() < 0.5:
        x, out = generator.uniform(0, 0.5 * length), 1.2
        slab = _box((x, x + 3), (-out, 0), (storey - 0.15, storey))
        rail = railing(3, generator)
        lifted = shapes.raised(shapes.placed(rail.triangles, x, -out), storey)
        yield _thing([slab, lifted], generator)
    start, end = (np.array([x, -0.15, 0.8 * height]) for x in (0, length))
    yield cable(start, end, 0.1, (0.005, 0.03), generator)
    if generator.random() < 0.4:
        leaves = generator.uniform((0, -0.3, 0), (0.4 * length, 0, 0.8 * height), (2500, 3))
        ivy = shapes.leaves(leaves, generator.uniform(0.015, 0.05), generator)
        yield _thing([ivy], generator)
    aerial = [((0.5 * length, 1, height), (0.5 * length, 1, height + 2))]
    aerial += [
        ((0.5 * length - 0.4, 1, z), (0.5 * length + 0.4, 1, z))
        for z in height + np.arange(1, 2, 0.25)
    ]
    yield _thing([bars(aerial, 0.012)], generator)


def _box(
    x: tuple[float, float], y: tuple[float, float], z: tuple[float, float]
) -> shapes.Triangles:
    box = shapes.box(x[1] - x[0], y[1] - y[0], *z)
    return shapes.placed(box, sum(x) / 2, sum(y) / 2)


def _thing(parts: list[shapes.Triangles], generator: np.random.Generator) -> Surface:
    return Surface(np.concatenate(parts), TrackClass.BACKGROUND, log_uniform(STONE, generator))
