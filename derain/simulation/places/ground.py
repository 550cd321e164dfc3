"""Ground that is nowhere flat: hills, bumps down to the size of a stone, banks, rubble, logs."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from derain.scan import Float32s, Floats, Ints
from derain.simulation import shapes
from derain.simulation.classes import TrackClass
from derain.simulation.drawing import Span, log_uniform, log_uniforms
from derain.simulation.objects import Surface, Surfaces, spotted

RELIEF_WAVES = 12
WAVELENGTHS = (2.5, 60.0)

# The mesh of the ground: corners per ring, rings, and their first and last radius, metres.
CORNERS = 400
RINGS = 100
RADII = (0.6, 130.0)

# Share of its reflectivity that wet ground keeps.
WET = 0.1


@dataclass(frozen=True, eq=False)
class Relief:
    """The height of the ground, a sum of waves.

    Attributes:
        waves: Wave vectors, float32 (W, 2), radians per metre.
        amplitudes: Float32 (W,), metres.
        phases: Float32 (W,), radians.
    """

    waves: Float32s
    amplitudes: Float32s
    phases: Float32s

    @classmethod
    def draw(cls, height: float, generator: Generator) -> "Relief":
        """Draws a relief.

        Args:
            height: Standard deviation of the height, metres. Long waves are higher than short ones.
            generator: Random generator.
        """
        length = log_uniforms(WAVELENGTHS, RELIEF_WAVES, generator)
        direction = generator.uniform(0, 2 * np.pi, RELIEF_WAVES)
        waves = 2 * np.pi / length * np.stack([np.cos(direction), np.sin(direction)])
        amplitudes = height * np.sqrt(2) * length / np.linalg.norm(length)
        phases = generator.uniform(0, 2 * np.pi, RELIEF_WAVES)
        return cls(*(part.astype(np.float32) for part in (waves.T, amplitudes, phases)))

    def __call__(self, x: Floats, y: Floats) -> Floats:
        """Heights at some places, metres, float64, shaped as they are; 0 under the sensor."""
        height = np.zeros(np.shape(x), np.float32)
        at_x, at_y = np.asarray(x, np.float32), np.asarray(y, np.float32)
        for (a, b), amplitude, phase in zip(self.waves, self.amplitudes, self.phases, strict=True):
            height += amplitude * (np.sin(a * at_x + b * at_y + phase) - np.sin(phase))
        return height.astype(np.float64)


@dataclass(frozen=True)
class GroundKind:
    """A kind of ground.

    Attributes:
        label: Its class.
        bumps: Standard deviation of the height of each corner of its mesh, metres.
        reflectivity: Between which its reflectivity is.
        wet: Share of it that is wet.
        furrow: Depth of its furrows, metres, a metre or less apart; 0 has none.
    """

    label: TrackClass
    bumps: Span
    reflectivity: Span
    wet: float = 0.0
    furrow: float = 0.0


ASPHALT = GroundKind(TrackClass.ROAD, (0.001, 0.008), (0.05, 0.25), wet=0.15)
COBBLES = GroundKind(TrackClass.ROAD, (0.008, 0.025), (0.08, 0.3), wet=0.1)
TRACK = GroundKind(TrackClass.ROAD, (0.015, 0.05), (0.1, 0.4), wet=0.1)
PAVING = GroundKind(TrackClass.BACKGROUND, (0.002, 0.012), (0.1, 0.4), wet=0.1)
MEADOW = GroundKind(TrackClass.BACKGROUND, (0.02, 0.1), (0.1, 0.5))
GRAVEL = GroundKind(TrackClass.BACKGROUND, (0.01, 0.05), (0.1, 0.4))
FIELD = GroundKind(TrackClass.BACKGROUND, (0.04, 0.12), (0.05, 0.3), wet=0.1, furrow=0.15)
SNOW = GroundKind(TrackClass.BACKGROUND, (0.01, 0.08), (0.3, 0.9))
CONCRETE = GroundKind(TrackClass.ROAD, (0.001, 0.006), (0.1, 0.4), wet=0.1)


def ground_mesh(
    kinds: Sequence[GroundKind], kind_at: Callable[[Floats, Floats], Ints], generator: Generator
) -> Surfaces:
    """The ground about the sensor: a plane with bumps, its mesh finest near the sensor.

    Args:
        kinds: Its materials.
        kind_at: Kind at each place, by x and y in metres, int64 as they are shaped.
        generator: Random generator.
    """
    corners = _rings()
    kind = kind_at(corners[..., 0], corners[..., 1])
    bumps = np.array([log_uniform(each.bumps, generator) for each in kinds])
    furrow = np.array([each.furrow * generator.uniform(0.3, 1) for each in kinds])
    corners[..., 2] = bumps[kind] * generator.normal(size=kind.shape)
    corners[..., 2] += furrow[kind] * _furrows(corners, generator)
    corners[:, -1, 2] = corners[:, 0, 2]  # each ring closes
    triangles = shapes.sheet(corners)
    kind = np.repeat(kind[:-1, :-1].ravel(), 2)
    wetness = Relief.draw(1, generator)(*triangles.mean(axis=1)[:, :2].T)
    for number, each in enumerate(kinds):
        mine = np.flatnonzero(kind == number)
        if not len(mine):
            continue
        # Uneven in reflectivity from spot to spot, and dark where it is wet.
        usual = log_uniform(each.reflectivity, generator)
        spots = usual * np.exp(generator.normal(0, 0.2, len(mine)))
        wettest = np.quantile(wetness[mine], 1 - each.wet)
        spots[wetness[mine] > wettest] *= WET
        yield Surface(triangles[mine], each.label, np.clip(spots, 0.003, 1))


def between(right: float, left: float) -> Callable[[Floats, Floats], Ints]:
    """Kinds of the ground by place: 0 between two y, in metres, as of a road along x, else 1."""
    return lambda x, y: np.where((y > right) & (y < left), 0, 1)


def _rings() -> Floats:
    """Corners on rings, float64 (RINGS + 1, CORNERS + 1, 3); the first ring is a point."""
    radius = np.concatenate([[0.0], np.geomspace(*RADII, RINGS)])[:, None]
    angle = np.linspace(0, 2 * np.pi, CORNERS + 1)
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    return np.stack([x, y, np.zeros_like(x)], axis=-1)


def _furrows(corners: Floats, generator: Generator) -> Floats:
    direction = generator.uniform(0, np.pi)
    over = corners[..., 0] * np.cos(direction) + corners[..., 1] * np.sin(direction)
    return np.asarray(np.sin(2 * np.pi / generator.uniform(0.4, 1) * over))


# Of snow, and of earth and stone.
BRIGHT, DULL = (0.3, 0.95), (0.05, 0.4)

# Standard deviation of the logarithm of reflectivity from spot to spot.
SPREAD = 0.25


def bank(length: float, generator: Generator, *, snow: bool = False) -> Surface:
    """A bank along x, from x = 0 on, lumpy all over.

    Args:
        length: Metres.
        generator: Random generator.
        snow: True if it is of snow that a plough has left.
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
