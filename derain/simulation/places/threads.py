"""Threads: nets, fences of wire and of mesh, cables in the air.

Threads are drawn as wide as beams see them, from some millimetres to some centimetres.
"""

from collections.abc import Iterator

import numpy as np
from numpy.random import Generator

from derain.simulation import shapes
from derain.simulation.arrays import Floats
from derain.simulation.drawing import Span, log_uniform
from derain.simulation.objects import Surface, of_material
from derain.simulation.shapes import Triangles

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


def chain_link(length: float, generator: Generator) -> Iterator[Surface]:
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


def wire_fence(length: float, generator: Generator) -> Iterator[Surface]:
    """A fence of a few level wires along x, barbed or not, with its posts."""
    height = generator.uniform(0.8, 1.5)
    for z in np.linspace(height / generator.integers(2, 7), height, generator.integers(2, 7)):
        starts, ends = np.array([[0, 0, z]]), np.array([[length, 0, z]])
        yield cable(starts[0], ends[0], 0.003 * length, (0.003, 0.012), generator)
    yield from posts(length, height + 0.1, generator)


def posts(length: float, height: float, generator: Generator) -> Iterator[Surface]:
    """Posts of a fence along x, from x = 0 on, some of them crooked."""
    x = np.arange(0, length, generator.uniform(*POST_SPACING))
    feet = np.column_stack([x, np.zeros_like(x), np.zeros_like(x)])
    heads = feet + generator.normal((0, 0, height), (0.04, 0.04, 0.03), feet.shape)
    radius = generator.uniform(0.015, 0.07)
    yield _strung(shapes.rods(feet, heads, radius, sides=6), generator)


def cable(start: Floats, end: Floats, sag: float, width: Span, generator: Generator) -> Surface:
    """A wire or cable between two places, (3,) each, metres.

    Args:
        start: Where it begins.
        end: Where it ends.
        sag: How far its middle hangs down, metres.
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
