"""Heaps: rubble, stones, logs, banks of earth and of snow."""

import numpy as np
from numpy.random import Generator

from derain.simulation import shapes
from derain.simulation.drawing import log_uniform, log_uniforms
from derain.simulation.objects import Surface, spotted

# Of snow, and of earth and stone.
BRIGHT, DULL = (0.3, 0.95), (0.05, 0.4)

# Standard deviation of the logarithm of reflectivity from spot to spot.
SPREAD = 0.25


def bank(length: float, generator: Generator, *, snow: bool = False) -> Surface:
    """A bank along x, from x = 0 on, lumpy all over.

    Args:
        length: Metres.
        generator: Random generator.
        snow: Whether it is of snow that a plough has left.
    """
    width, height = generator.uniform(0.8, 4), log_uniform((0.2, 2.0), generator)
    cell = np.sqrt(length * width / 1500)
    x = np.linspace(0, length, 3 + int(length / cell))
    y = np.linspace(-width / 2, width / 2, 3 + int(width / cell))
    over, beside = np.meshgrid(x, y, indexing="ij")
    # Round across its width, and lower towards its ends.
    ridge = np.cos(np.pi * beside / width) * np.minimum(1, 3 * np.sin(np.pi * over / length))
    lumps = generator.uniform(0.03, 0.25) * height * generator.normal(size=over.shape)
    waves = 1 + 0.3 * np.sin(generator.uniform(0.3, 1.5) * over + generator.uniform(0, 6))
    up = height * ridge * waves + lumps * (ridge > 0.05) - 0.03
    triangles = shapes.sheet(np.stack([over, beside, up], axis=-1))
    return spotted(triangles, BRIGHT if snow else DULL, SPREAD, generator)


def rubble(radius: float, generator: Generator) -> Surface:
    """Stones, bricks and clods on a heap, of some centimetres to some decimetres.

    Args:
        radius: Of the heap, metres.
        generator: Random generator.
    """
    count = int(generator.integers(100, 900))
    size = log_uniforms((0.015, 0.15), count, generator)
    place = generator.normal(0, 0.45 * radius, (count, 2))
    height = 0.5 * radius * np.exp(-2 * (place / radius) ** 2).prod(axis=1)
    middle = np.column_stack([place, height * generator.uniform(0.7, 1, count)])
    # Each is a crooked tetrahedron.
    corners = middle[:, None] + size[:, None, None] * generator.normal(0, 1, (count, 4, 3))
    faces = corners[:, [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]]
    return spotted(faces.reshape(-1, 3, 3), DULL, SPREAD, generator)


def logs(generator: Generator) -> Surface:
    """Trunks in a stack along x."""
    length, radius = generator.uniform(2, 6), generator.uniform(0.08, 0.25)
    rows = generator.integers(1, 5)
    places = [
        (2 * radius * (i + row / 2), radius * (1 + 1.73 * row))
        for row in range(rows)
        for i in range(2 * rows - row)
    ]
    ends = [
        np.array([[x, y, z] for y, z in places]) + generator.normal(0, 0.05, (len(places), 3))
        for x in (0, length)
    ]
    return spotted(shapes.rods(ends[0], ends[1], radius, sides=8), DULL, SPREAD, generator)
