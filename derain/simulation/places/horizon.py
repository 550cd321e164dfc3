"""Things 50 to 280 m away, which few beams reach: rows of trees, hills, corners, pylons."""

import itertools
from collections.abc import Callable

import numpy as np
from numpy.random import Generator

from derain.simulation import shapes
from derain.simulation.classes import TrackClass
from derain.simulation.drawing import log_uniform, log_uniforms
from derain.simulation.objects import Surface, Surfaces, of_material
from derain.simulation.places import openwork
from derain.simulation.places.placing import place
from derain.simulation.shapes import Triangles

# Where things stand, and where the hills begin and end, metres.
HORIZON = (55.0, 260.0)
HILLS = (118.0, 290.0)

# What stands reaches so far below the level of the sensor's foot: the ground there is uneven.
DEPTH = 6.0

FAR_LEAF = (0.01, 0.4)
HORIZON_REFLECTIVITY = (0.03, 0.9)

# Signs and plates beside roads return light whence it came: they are seen from afar.
RETROREFLECTIVE = (0.7, 1.0)


def lay_out_horizon(generator: Generator) -> Surfaces:
    """Lays out distant things, for any place outdoors.

    Args:
        generator: Random generator.

    Yields:
        Surfaces in the frame of a track, all of them at least 40 m from its origin: rough, hilly
        ground from 118 m on, and on it and nearer rows of trees full of gaps, single trees, corners
        of buildings, poles, masts, signs, cables, lorries and small things that glint.
    """
    yield _hills(generator)
    kinds: list[tuple[Callable[[float, Generator], Surfaces], int]] = [
        (_row_of_trees, 5),
        (_tree, 12),
        (_building, 8),
        (_poles, 6),
        (_pylons, 2),
        (_sign, 10),
        (_vehicle, 6),
        (_scrub, 8),
        (_glint, 40),
    ]
    for make, most in kinds:
        for _ in range(generator.integers(0, most + 1)):
            away = log_uniform(HORIZON, generator)
            azimuth = generator.uniform(-np.pi, np.pi)
            x, y = away * np.cos(azimuth), away * np.sin(azimuth)
            yield from place(make(away, generator), x, y, azimuth)


def _hills(generator: Generator) -> Surface:
    """A ring of ground that rises or falls away from the sensor, waves on waves, stones on them."""
    angle = np.linspace(0, 2 * np.pi, 241)
    away = np.geomspace(*HILLS, 22)[:, None]
    share = (away - HILLS[0]) / (HILLS[1] - HILLS[0])
    height = generator.uniform(-12, 25) * share**1.5 * np.ones_like(angle)
    for waves in generator.integers(1, 24, 8):
        turned = waves * angle + generator.uniform(0, 2 * np.pi) + generator.normal(0, 3) * share
        height += generator.uniform(0, 8) / waves**0.7 * share * np.sin(turned)
    height += log_uniform((0.02, 0.6), generator) * generator.normal(size=height.shape)
    height[:, -1] = height[:, 0]
    ring = np.stack([away * np.cos(angle), away * np.sin(angle), height - 1.5], axis=-1)
    triangles = shapes.sheet(ring)
    usual = log_uniform((0.01, 0.3), generator)
    spread = log_uniforms((0.2, 3), len(triangles), generator)
    return Surface(triangles, TrackClass.BACKGROUND, usual * spread)


def _row_of_trees(away: float, generator: Generator) -> Surfaces:
    """A row or an edge of a wood across the line of sight, of crowns that differ, with gaps."""
    half = min(generator.uniform(10, 90), 0.8 * away)
    spacing, gaps = generator.uniform(3, 10), generator.uniform(0, 0.6)
    depth, turned = generator.uniform(0, 6), generator.uniform(-0.4, 0.4)
    parts = []
    for y in np.arange(-half, half, spacing):
        if generator.random() > gaps:
            x = generator.normal(0, depth) + turned * y
            if away + x > HORIZON[0]:
                parts.append(shapes.placed(_crown(250, generator), x, y))
    if parts:
        yield _plant(np.concatenate(parts), generator)


def _tree(away: float, generator: Generator) -> Surfaces:
    """A tree by itself, its crown sparse or dense, on a stem."""
    yield _plant(_crown(900, generator), generator)


def _scrub(away: float, generator: Generator) -> Surfaces:
    """Bushes and stalks by the dozen, each seen by a beam or none."""
    count = int(log_uniform((10, 300), generator))
    spread = generator.uniform((1, 3), (4, 20)) / 2
    level, up = generator.normal(0, spread, (count, 2)), generator.uniform(-2, 2.5, count)
    places = np.clip(np.column_stack([level, up]), -40, 40) + np.array([45, 0, 0])
    size = log_uniform((0.03, 0.3), generator)
    yield _plant(shapes.leaves(places, size, generator), generator)


def _crown(most: int, generator: Generator) -> Triangles:
    """Leaves about boughs, some clumped, over a stem."""
    height = log_uniform((4, 22), generator)
    radii = height * generator.uniform(0.12, 0.3, 3)
    count = int(log_uniform((15, most), generator))
    centres = shapes.inside_ellipsoid(count, (radii[0], radii[1], radii[2]), generator)
    clumps = centres[generator.integers(count, size=max(2, count // 12))]
    own = clumps[generator.integers(len(clumps), size=count)]
    centres += generator.choice([0.0, 0.4, 0.8]) * (own - centres)
    leaves = shapes.leaves(centres, log_uniform(FAR_LEAF, generator), generator)
    middle = height - radii[2]
    stem = shapes.bars([((0, 0, -DEPTH), (0, 0, middle))], 0.02 * height, sides=3)
    return np.concatenate([shapes.raised(leaves, middle), stem])


def _building(away: float, generator: Generator) -> Surfaces:
    """A building of one to three blocks with eaves, chimneys and aerials, its corner ahead."""
    for _ in range(generator.integers(1, 4)):
        length, width = generator.uniform(6, 25, 2)
        top = log_uniform((3, 25), generator)
        at = generator.uniform(0, 12) + 16, generator.uniform(-15, 15)
        heading = generator.uniform(-np.pi, np.pi)
        block = shapes.box(length, width, -DEPTH, top, at, heading)
        yield of_material([block], HORIZON_REFLECTIVITY, generator)
        rods = [
            ((a, b, top), (a, b, top + generator.uniform(0.5, 4)))
            for a, b in generator.uniform(-3, 3, (generator.integers(0, 5), 2))
        ]
        if rods:
            thin = shapes.bars(rods, log_uniform((0.01, 0.3), generator))
            aerials = shapes.placed(thin, *at, heading)
            yield of_material([aerials], HORIZON_REFLECTIVITY, generator)


def _poles(away: float, generator: Generator) -> Surfaces:
    """Lamps or poles in a line across, with arms; perhaps a cable from each to the next."""
    count, step = int(generator.integers(1, 8)), generator.uniform(8, 30)
    height, radius = generator.uniform(3, 12), log_uniform((0.02, 0.2), generator)
    ahead = generator.uniform(-0.3, 1.0)
    y = step * (np.arange(count) - (count - 1) / 2)
    x = np.maximum(ahead * y, HORIZON[0] - away)
    rods = [((a, b, -DEPTH), (a, b, height)) for a, b in zip(x, y, strict=True)]
    rods += [((a, b, height), (a, b + 1.5, height + 0.2)) for a, b in zip(x, y, strict=True)]
    yield of_material([shapes.bars(rods, radius, 6)], HORIZON_REFLECTIVITY, generator)
    if generator.random() < 0.5:
        heads = np.column_stack([x, y, np.full(count, height)])
        for start, end in itertools.pairwise(heads):
            yield openwork.cable(start, end, generator.uniform(0.2, 1.5), (0.01, 0.06), generator)


def _pylons(away: float, generator: Generator) -> Surfaces:
    """Two lattice masts with arms and the cables between them."""
    height, apart = generator.uniform(12, 40), generator.uniform(30, 120)
    heads = []
    for y in (-apart / 2, apart / 2):
        yield openwork.lattice((0, y, -DEPTH), (0, y, height), generator.uniform(0.6, 2), generator)
        arm = [((-4.0, y, height - 3), (4.0, y, height - 3))]
        yield of_material([shapes.bars(arm, 0.15)], HORIZON_REFLECTIVITY, generator)
        heads.append([(x, y, height - 3) for x in (-4.0, 0.0, 4.0)])
    for start, end in zip(*np.array(heads), strict=True):
        yield openwork.cable(start, end, 0.03 * apart, (0.015, 0.08), generator)


def _sign(away: float, generator: Generator) -> Surfaces:
    """A retroreflecting sign, plate or marker post, towards the sensor or turned from it."""
    side, top = log_uniform((0.08, 3), generator), log_uniform((0.6, 7), generator)
    plate = shapes.box(0.03, side, top - side, top, heading=generator.normal(0, 0.6))
    yield Surface(plate, TrackClass.BACKGROUND, generator.uniform(*RETROREFLECTIVE))
    post = shapes.bars([((0.05, 0, -DEPTH), (0.05, 0, top))], 0.04)
    yield of_material([post], HORIZON_REFLECTIVITY, generator)


def _glint(away: float, generator: Generator) -> Surfaces:
    """A lamp, a marker or a scrap of metal that returns light from afar, to one beam or two."""
    size, height = log_uniform((0.05, 0.5), generator), generator.uniform(-1, 8)
    glint = shapes.raised(shapes.leaves(np.zeros((1, 3)), size, generator), height)
    yield Surface(glint, TrackClass.BACKGROUND, generator.uniform(*RETROREFLECTIVE))


def _vehicle(away: float, generator: Generator) -> Surfaces:
    """A car or a lorry; some beams meet its lamps or the edges of its roof."""
    length, width, height = [(4.4, 1.8, 1.5), (10.0, 2.5, 3.6)][int(generator.random() < 0.3)]
    body = shapes.box(length, width, -1.0, height, heading=generator.uniform(-np.pi, np.pi))
    yield of_material([body], (0.02, 0.6), generator, TrackClass.CAR)


def _plant(triangles: Triangles, generator: Generator) -> Surface:
    """Leaves that return from nearly nothing to nearly all of the light."""
    usual = log_uniform((0.1, 0.7), generator)
    spread = log_uniforms((0.3, 1.4), len(triangles), generator)
    return Surface(triangles, TrackClass.BACKGROUND, np.minimum(usual * spread, 1))
