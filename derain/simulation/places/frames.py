"""Open-work: gates, railings, scaffolds, lattice masts, guard rails, trolleys, thin poles."""

from collections.abc import Iterator

import numpy as np
from numpy.random import Generator

from derain.simulation import shapes
from derain.simulation.drawing import log_uniform
from derain.simulation.objects import Surface, of_material
from derain.simulation.shapes import Point, Triangles, bars

FRAME_REFLECTIVITY = (0.03, 0.7)


def thin_pole(generator: Generator) -> Surface:
    """A pole of 5 mm to 6 cm, leaning or not, some with a sign or a lamp on it."""
    height, radius = generator.uniform(0.6, 6), log_uniform((0.005, 0.06), generator)
    foot, lean = (0.0, 0.0, 0.0), generator.normal(0, 0.03, 2) * height
    parts = [bars([(foot, (lean[0], lean[1], height))], radius, sides=6)]
    if generator.random() < 0.3:
        side, heading = generator.uniform(0.2, 0.8), generator.uniform(0, np.pi)
        parts.append(shapes.box(0.02, side, height - side, height, (lean[0], lean[1]), heading))
    return made(parts, generator)


def railing(length: float, generator: Generator) -> Surface:
    """A railing or gate of bars along x, from x = 0 on."""
    height, bottom = generator.uniform(0.8, 2.2), generator.uniform(0.05, 0.25)
    radius = log_uniform((0.006, 0.03), generator)
    x = np.arange(0, length, generator.uniform(0.08, 0.25))
    upright = [((at, 0, bottom), (at, 0, height)) for at in x]
    level = [((0, 0, z), (length, 0, z)) for z in (bottom, height)]
    braces = [((0, 0, bottom), (min(length, 3.0), 0, height))] if generator.random() < 0.4 else []
    return made([bars(upright, radius), bars([*level, *braces], 1.8 * radius)], generator)


def scaffold(length: float, generator: Generator) -> Iterator[Surface]:
    """Tubes and boards along x, from x = 0 on, two or three storeys high."""
    storeys, depth = generator.integers(1, 4), generator.uniform(0.7, 1.2)
    step, storey, radius = generator.uniform(1.8, 2.6), 2.0, generator.uniform(0.02, 0.035)
    x = step * np.arange(max(2, 1 + int(length / step)))  # one bay at least
    top = storeys * storey + 1
    tubes: list[tuple[Point, Point]] = [((at, y, 0), (at, y, top)) for at in x for y in (0, depth)]
    for level in range(1, storeys + 1):
        z = level * storey
        tubes += [((0, y, z + up), (x[-1], y, z + up)) for y in (0, depth) for up in (0, 1)]
        tubes += [((at, 0, z), (at, depth, z)) for at in x]
        braced = [at for at in x[:-1] if generator.random() < 0.4]
        tubes += [((at, 0, z - storey), (at + step, 0, z)) for at in braced]
    yield made([bars(tubes, radius)], generator)
    boards = [
        shapes.box(x[-1], depth, z, z + 0.05, at=(x[-1] / 2, depth / 2))
        for z in storey * np.arange(1, storeys + 1)
        if generator.random() < 0.8
    ]
    if boards:
        yield made(boards, generator)


def lattice(start: Point, end: Point, width: float, generator: Generator) -> Surface:
    """A square lattice girder or mast between two places.

    Args:
        start: Middle of one end, metres.
        end: Middle of the other.
        width: Across it, metres.
        generator: Random generator.
    """
    first, last = np.array([start]), np.array([end])
    aside, up = (vector[0] * width / 2 for vector in shapes.across(last - first))
    edges = [i * aside + j * up for i, j in ((1, 1), (1, -1), (-1, -1), (-1, 1))]
    bays = max(2, int(np.linalg.norm(last - first) / width))
    knots = first + np.linspace(0, 1, bays + 1)[:, None] * (last - first)
    wood = [shapes.rods(knots[:1] + edge, knots[-1:] + edge, 0.05) for edge in edges]
    for one, other in zip(edges, edges[1:] + edges[:1], strict=True):
        wood.append(shapes.rods(knots[:-1] + one, knots[1:] + other, 0.025))
    return made(wood, generator)


def guard_rail(length: float, generator: Generator) -> Iterator[Surface]:
    """A steel guard rail along x, from x = 0 on: a band on posts."""
    profile = np.array([[0, 0.45], [0.05, 0.52], [0, 0.6], [0.05, 0.68], [0, 0.75]])
    x = np.linspace(0, length, max(2, int(length / 4)))
    level = np.stack([np.column_stack(np.broadcast_arrays(x, y, z)) for y, z in profile])
    band = level + generator.normal(0, 0.01, level.shape)
    posts = [((at, 0.08, 0), (at, 0.08, 0.7)) for at in np.arange(0, length, 2.0)]
    yield made([shapes.sheet(band), bars(posts, 0.05)], generator)


def trolley(generator: Generator) -> Surface:
    """A shopping trolley: a basket of wire, a handle, wheels."""
    length, width, low, high = 0.9, 0.55, 0.4, 0.95
    radius, half = log_uniform((0.003, 0.01), generator), width / 2
    wires = [((x, y, low), (x, y, high)) for x in np.arange(0, length, 0.12) for y in (-half, half)]
    wires += [((x, -half, low), (x, half, low)) for x in np.arange(0, length, 0.12)]
    heights = np.arange(low, high, 0.13)
    wires += [((0, y, z), (length, y, z)) for y in (-half, half) for z in heights]
    frame: list[tuple[Point, Point]] = [((0, y, 0.1), (length, y, 0.15)) for y in (-half, half)]
    frame += [((0, y, 0.1), (-0.15, y, 1.0)) for y in (-half, half)]
    frame += [((-0.15, -half, 1.0), (-0.15, half, 1.0))]
    return made([bars(wires, radius), bars(frame, 0.018)], generator)


def bollard(generator: Generator) -> Surface:
    """A bollard, a cone's height or a man's waist."""
    radius, height = generator.uniform(0.03, 0.12), generator.uniform(0.4, 1.1)
    return made([shapes.cylinder(radius, 0, height)], generator)


def made(parts: list[Triangles], generator: Generator) -> Surface:
    """Parts of one material as a surface."""
    return of_material(parts, FRAME_REFLECTIVITY, generator)
