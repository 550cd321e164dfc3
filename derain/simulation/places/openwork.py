"""Objects that rays pass in part: railings, scaffolds, lattices, nets, fences, cables, panes.

Threads are drawn as wide as beams see them, from some millimetres to some centimetres.
"""

import numpy as np
from numpy.random import Generator

from derain.scan import Floats
from derain.simulation import shapes
from derain.simulation.drawing import Span, log_uniform
from derain.simulation.objects import Surface, Surfaces, of_material
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


def scaffold(length: float, generator: Generator) -> Surfaces:
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


def guard_rail(length: float, generator: Generator) -> Surfaces:
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


THREAD_REFLECTIVITY = (0.03, 0.6)
POST_SPACING = (2.0, 4.0)


def net(length: float, height: float, generator: Generator) -> Surface:
    """A net that hangs in the x-z plane from x = 0 on, billowing and torn.

    Args:
        length: Metres along x.
        height: Metres from the ground on.
        generator: Random generator.
    """
    mesh = max(log_uniform((0.05, 0.4), generator), np.sqrt(length * height / 2500))
    x, z = np.arange(0, length, mesh), np.arange(0, height, mesh)
    knots = shapes.upright_grid(x, z)
    billow = generator.uniform(0, 0.3) * np.sin(np.pi * knots[..., 2] / height)
    knots[..., 1] += billow * np.sin(generator.uniform(0.3, 2) * knots[..., 0])
    knots += generator.normal(0, 0.12 * mesh, knots.shape)
    starts = np.concatenate([knots[:-1].reshape(-1, 3), knots[:, :-1].reshape(-1, 3)])
    ends = np.concatenate([knots[1:].reshape(-1, 3), knots[:, 1:].reshape(-1, 3)])
    whole = generator.random(len(starts)) > generator.choice([0, 0.02, 0.2])
    width = log_uniform((0.004, 0.03), generator)
    return _strung(_ribbons(starts[whole], ends[whole], width), generator)


def chain_link(length: float, generator: Generator) -> Surfaces:
    """A fence of diagonal wire along x, from x = 0 on, with its posts."""
    height, mesh = generator.uniform(1, 2.2), generator.uniform(0.05, 0.14)
    width = log_uniform((0.003, 0.012), generator)
    offsets = np.arange(-height, length, mesh * np.sqrt(2))
    # Each wire is cut off where the fence ends.
    low, high = np.maximum(0, -offsets), np.minimum(height, length - offsets)
    keep = high > low + mesh
    offsets, low, high = offsets[keep], low[keep], high[keep]
    nothing = np.zeros_like(offsets)
    rising = [np.column_stack([offsets + z, nothing, z]) for z in (low, high)]
    falling = [np.column_stack([offsets + z, nothing, height - z]) for z in (low, high)]
    wires = [_ribbons(start, end, width) for start, end in (rising, falling)]
    yield _strung(np.concatenate(wires), generator)
    yield from posts(length, height + 0.05, generator)


def wire_fence(length: float, generator: Generator) -> Surfaces:
    """A fence of a few level wires along x, barbed or not, with its posts."""
    height = generator.uniform(0.8, 1.5)
    for z in np.linspace(height / generator.integers(2, 7), height, generator.integers(2, 7)):
        start, end = np.array([0, 0, z]), np.array([length, 0, z])
        yield cable(start, end, 0.003 * length, (0.003, 0.012), generator)
    yield from posts(length, height + 0.1, generator)


def posts(length: float, height: float, generator: Generator) -> Surfaces:
    """Posts of a fence along x, from x = 0 on, some of them crooked."""
    x = np.arange(0, length, generator.uniform(*POST_SPACING))
    feet = np.column_stack([x, np.zeros_like(x), np.zeros_like(x)])
    heads = feet + generator.normal((0, 0, height), (0.04, 0.04, 0.03), feet.shape)
    radius = generator.uniform(0.015, 0.07)
    yield _strung(shapes.rods(feet, heads, radius, sides=6), generator)


def cable(start: Floats, end: Floats, sag: float, width: Span, generator: Generator) -> Surface:
    """A wire or cable between two places, (3,) each, metres.

    Args:
        start: Its start.
        end: Its end.
        sag: Depth of its middle below the ends, metres.
        width: Between which its thickness is drawn, metres.
        generator: Random generator.
    """
    share = np.linspace(0, 1, 17)[:, None]
    knots = start + share * (end - start) - 4 * sag * share * (1 - share) * np.array([0, 0, 1])
    radius = log_uniform(width, generator) / 2
    return _strung(shapes.rods(knots[:-1], knots[1:], radius), generator)


def _ribbons(starts: Floats, ends: Floats, width: float) -> Triangles:
    """Flat threads in planes upright along x, two triangles each."""
    along = ends - starts
    aside = np.cross(along, (0.0, 1.0, 0.0))
    aside *= width / 2 / np.maximum(np.linalg.norm(aside, axis=1, keepdims=True), 1e-9)
    return shapes.quads(starts - aside, starts + aside, ends + aside, ends - aside)


def _strung(triangles: Triangles, generator: Generator) -> Surface:
    return of_material([triangles], THREAD_REFLECTIVITY, generator)


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
