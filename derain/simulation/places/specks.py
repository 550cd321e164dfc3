"""Specks on a surface that mirrors the light away: dust, edges, scratches."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.random import Generator

from derain.simulation.arrays import Floats
from derain.simulation.drawing import log_uniform
from derain.simulation.objects import Surface
from derain.simulation.shapes import Triangles

# Of what returns, and of what reflects so little towards the sensor that no detector sees it.
PAINT = (0.01, 0.6)
MIRROR = 1e-9

# Nothing is nearer to the sensor, metres.
NEAREST_SPECK = 0.15

# Size of a speck over its distance from the sensor: it returns one ray or two.
SIZE = (1.5e-3, 8e-3)


def specks(surface: Triangles, sensor: Floats, count: int, generator: Generator) -> Triangles:
    """Small triangles on a surface, evenly or in clumps, so that few rays meet one.

    Args:
        surface: Triangles that they lie on, (T, 3, 3), metres.
        sensor: Place of the sensor, (3,), metres. The farther a speck is, the larger it is, so that
            a beam, which widens as well, is returned by it.
        count: How many.
        generator: Random generator.

    Returns:
        At most so many; fewer where they would be too near to the sensor.
    """
    places = on_surface(surface, count, generator)
    # A clump is what lies nearest to one of a few places: the rest of the surface stays empty.
    share = generator.choice([1.0, 0.4, 0.15])
    clumps = places[generator.integers(len(places), size=1 + count // 25)]
    from_clumps = np.linalg.norm(places[:, None] - clumps, axis=2).min(axis=1)
    places = places[from_clumps <= np.quantile(from_clumps, share)]
    size = log_uniform(SIZE, generator) * np.linalg.norm(places - sensor, axis=1)
    corners = generator.normal(0, 1, (len(places), 3, 3))
    small = places[:, None] + size[:, None, None] * np.clip(corners, -2, 2)
    away = np.linalg.norm(small - sensor, axis=2).min(axis=1)
    return np.asarray(small[away > NEAREST_SPECK])


def mirrored(
    surface: Surface, sensor: Floats, count: int, generator: Generator
) -> Iterator[Surface]:
    """A surface that mirrors the light away and hides what is behind it, with specks on it.

    Args:
        surface: The surface as it would be if it returned all over.
        sensor: Place of the sensor, (3,), metres.
        count: How many specks.
        generator: Random generator.
    """
    yield replace(surface, reflectivity=MIRROR)
    on_it = specks(surface.triangles, sensor, count, generator)
    if len(on_it):
        yield Surface(on_it, surface.label, log_uniform(PAINT, generator))


def on_surface(surface: Triangles, count: int, generator: Generator) -> Floats:
    """Places uniform over the area of triangles, (count, 3), metres."""
    first, second, third = surface.transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(second - first, third - first), axis=1)
    which = generator.choice(len(surface), count, p=area / area.sum())
    u, v = generator.random((2, count, 1))
    beyond = u + v > 1
    u, v = np.where(beyond, 1 - u, u), np.where(beyond, 1 - v, v)
    return np.asarray(first[which] + u * (second - first)[which] + v * (third - first)[which])
