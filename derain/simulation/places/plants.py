"""Plants: leaves of every size and density, bare twigs, grass.

A ray hits a leaf or misses it, while a beam is often filled by it only in part; hence the wide
spread of reflectivity.
"""

import numpy as np
from numpy.random import Generator

from derain.scan import Floats
from derain.simulation import shapes
from derain.simulation.classes import TrackClass
from derain.simulation.drawing import log_uniform, log_uniforms
from derain.simulation.objects import Surface, Surfaces
from derain.simulation.shapes import Triangles

PLANT_REFLECTIVITY = (0.01, 0.6)

# Standard deviation of a corner of a leaf about its middle, metres: leaves of 1 to 15 cm.
LEAF = (0.005, 0.06)

# How often a ray through the middle of a plant meets a leaf, and the most leaves that one has.
COVER = (0.05, 3.0)
MOST_LEAVES = 6000

# Children of a bough, and a child's length over its parent's.
CHILDREN = 4
SHORTENING = (0.45, 0.8)


def bush(radii: tuple[float, float, float], generator: Generator) -> Surface:
    """Leaves in an ellipsoid that stands on the ground, in clumps or evenly.

    Args:
        radii: Half-axes, metres.
        generator: Random generator.
    """
    return _plant(shapes.raised(_leaves(radii, generator), 0.9 * radii[2]), generator)


def crowned_tree(generator: Generator) -> Surfaces:
    """A tree in leaf, from a sapling to one of 12 m."""
    height = log_uniform((2.0, 12.0), generator)
    radii = height * generator.uniform(0.12, 0.35, 3)
    crown = shapes.raised(_leaves(tuple(radii), generator), height - radii[2])
    yield _plant(crown, generator)
    yield _plant(_boughs(0.8 * height, 3, generator), generator)


def bare_tree(generator: Generator) -> Surface:
    """A tree in winter: a trunk, boughs, and twigs down to a finger's width."""
    return _plant(_boughs(log_uniform((2.0, 10.0), generator), 6, generator), generator)


def tree(winter: bool, generator: Generator) -> Surface | Surfaces:
    """A bare tree in winter, else one in leaf."""
    return bare_tree(generator) if winter else crowned_tree(generator)


def brushwood(radius: float, generator: Generator) -> Surface:
    """Bare rods and brambles that rise from one spot, as far as a radius in metres."""
    count = int(generator.integers(15, 80))
    starts = np.column_stack([generator.normal(0, 0.15 * radius, (count, 2)), np.zeros(count)])
    ends = starts + radius * generator.normal((0, 0, 0.9), (0.45, 0.45, 0.3), (count, 3))
    ends[:, 2] = np.abs(ends[:, 2]) + 0.05
    width = log_uniform((0.004, 0.03), generator)
    stems = shapes.blades(starts, ends, 1.5 * width, generator)
    where = generator.random((count * 4, 1))
    starts = (starts + where.reshape(4, count, 1) * (ends - starts)).reshape(-1, 3)
    ends = starts + 0.35 * radius * generator.normal(0, 0.5, starts.shape)
    ends[:, 2] = np.abs(ends[:, 2])
    return _plant(np.concatenate([stems, shapes.blades(starts, ends, width, generator)]), generator)


def hedge(length: float, generator: Generator) -> Surface:
    """A hedge along x, from x = 0 on: dense or full of gaps, clipped or wild.

    Args:
        length: Metres.
        generator: Random generator.
    """
    height, depth = generator.uniform(0.6, 2.5), generator.uniform(0.4, 1.5)
    size = log_uniform(LEAF, generator)
    cover = log_uniform((0.5, 3.0), generator)
    count = min(int(cover * length * height / _area(size)), int(600 * length))
    x, u, v = generator.random((3, count))
    # Most leaves are at the outside, where there is light.
    y = depth / 2 * np.sign(u - 0.5) * np.abs(2 * u - 1) ** generator.uniform(0.2, 1)
    wild = 1 + generator.uniform(0, 0.4) * np.sin(generator.uniform(0.3, 2) * length * x)
    z = height * v ** generator.uniform(0.6, 1) * wild
    centres = np.column_stack([length * x, y, z])
    return _plant(shapes.leaves(centres, size, generator), generator)


def grass(places: Floats, generator: Generator) -> Surface:
    """Blades, from a lawn's to reeds', in tufts.

    Args:
        places: Middles of the tufts on the ground, (T, 2), metres.
        generator: Random generator.
    """
    tuft = generator.uniform(0.03, 0.25)
    blades = generator.integers(3, 14)
    centres = np.repeat(places, blades, axis=0)
    feet = centres + generator.normal(0, tuft, centres.shape)
    usual = log_uniform((0.08, 0.9), generator)
    height = usual * generator.uniform(0.4, 1.3, len(feet))
    lean = height[:, None] * generator.normal(0, 0.35, feet.shape)
    starts = np.column_stack([feet, np.zeros(len(feet))])
    ends = np.column_stack([feet + lean, height])
    width = log_uniform((0.006, 0.03), generator)
    return _plant(shapes.blades(starts, ends, width, generator), generator)


def _plant(triangles: Triangles, generator: Generator) -> Surface:
    reflectivity = log_uniforms(PLANT_REFLECTIVITY, len(triangles), generator)
    return Surface(triangles, TrackClass.BACKGROUND, reflectivity)


def _leaves(radii: tuple[float, float, float], generator: Generator) -> Triangles:
    """Leaves in an ellipsoid about the origin, sparse or dense, some of them in clumps."""
    size = log_uniform(LEAF, generator)
    shadow = np.pi * np.sqrt(radii[0] * radii[1]) * radii[2]
    cover = log_uniform(COVER, generator)
    count = int(np.clip(cover * shadow / _area(size), 20, MOST_LEAVES))
    centres = shapes.inside_ellipsoid(count, radii, generator)
    clumps = int(generator.integers(2, 1 + max(3, count // 15)))
    own = shapes.inside_ellipsoid(clumps, radii, generator)[generator.integers(clumps, size=count)]
    centres += generator.choice([0.0, 0.5, 0.85]) * (own - centres)
    return shapes.leaves(centres, size, generator)


def _area(size: float) -> float:
    """About the area that a leaf covers as a ray sees it, square metres."""
    return 1.3 * size**2


def _boughs(height: float, generations: int, generator: Generator) -> Triangles:
    """A trunk as high as half of the tree, and what branches from it, generation by generation."""
    starts = np.zeros((1, 3))
    ends = np.array([[*generator.normal(0, 0.05 * height, 2), 0.5 * height]])
    radius = log_uniform((0.012, 0.03), generator) * height
    wood = [shapes.rods(starts, ends, radius, taper=0.6, sides=8)]
    for generation in range(1, generations):
        length = np.linalg.norm(ends - starts, axis=1)
        children = CHILDREN if generation < 4 else 3
        parent = np.repeat(np.arange(len(starts)), children)
        share = generator.uniform(0.35, 1, (len(parent), 1))
        at = starts[parent] + share * (ends - starts)[parent]
        ahead = (ends - starts)[parent] / length[parent, None]
        direction = ahead + generator.normal((0, 0, 0.15), 0.55, at.shape)
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        reach = length[parent] * generator.uniform(*SHORTENING, len(parent))
        starts, ends = at, at + reach[:, None] * direction
        ends[:, 2] = np.maximum(ends[:, 2], 0.3)
        radius = max(0.5 * radius, 0.004)
        if generation < 3:
            wood.append(shapes.rods(starts, ends, radius, taper=0.5))
        else:
            wood.append(shapes.blades(starts, ends, 2.5 * radius, generator))
    return np.concatenate(wood)
