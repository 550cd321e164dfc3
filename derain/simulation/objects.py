"""Surfaces, and the things that stand on the simulated track, each at the origin of its own frame.

Reflectivities are modelling choices for a near-infrared LiDAR, drawn per object; sizes are those of
everyday objects.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator

from derain.scan import Bools, Floats
from derain.simulation import shapes
from derain.simulation.classes import TrackClass
from derain.simulation.drawing import Span, log_uniform, log_uniforms
from derain.simulation.shapes import Triangles

BACKGROUND = TrackClass.BACKGROUND


@dataclass(frozen=True, eq=False)
class Surface:
    """Triangles of one class.

    Attributes:
        triangles: Corners, float64 (T, 3, 3), metres.
        label: Class of all of them.
        reflectivity: Of each triangle, float64 (T,), or of all of them, in 0..1.
        roughness: Of all of them, radians, see :func:`derain.simulation.track.backscatter`.
    """

    triangles: Triangles
    label: TrackClass
    reflectivity: Floats | float
    roughness: float = 0.0

    def placed(self, x: float, y: float, heading: float = 0.0) -> "Surface":
        """The same surface, turned by a heading in radians, then moved to (x, y)."""
        return replace(self, triangles=shapes.placed(self.triangles, x, y, heading))

    def moved(self, x: float, y: float, z: float) -> "Surface":
        """The same surface, moved by metres along the three axes."""
        return replace(self, triangles=self.triangles + np.array([x, y, z]))

    def part(self, rows: Bools) -> "Surface":
        """The same surface with some of its triangles, by a mask, bool (T,)."""
        reflectivity = np.broadcast_to(self.reflectivity, len(rows))[rows]
        return replace(self, triangles=self.triangles[rows], reflectivity=reflectivity)

    def sloped(self, ahead: float, left: float) -> "Surface":
        """The same surface, raised by a share of its x and of its y, as on sloping ground."""
        return replace(self, triangles=shapes.sloped(self.triangles, ahead, left))


# Surfaces as they are made, one after the other.
Surfaces = Iterator[Surface]

# Something of one surface or of several, and what makes it at the origin.
Thing = Surface | Iterable[Surface]
Make = Callable[[Generator], Thing]

# Makers of objects, and their shares in a random choice.
Options = Iterable[tuple[Make, float]]

# Made piece by piece along a line, by the length of a piece in metres.
Piece = Callable[[float, Generator], Thing]


def of_size(make: Callable[..., Thing], *sizes: Span) -> Make:
    """Makes things whose sizes, in metres, are each uniform between two values."""
    return lambda generator: make(*(generator.uniform(*size) for size in sizes), generator)


def of_material(
    parts: Sequence[Triangles],
    reflectivity: Span,
    generator: Generator,
    label: TrackClass = BACKGROUND,
) -> Surface:
    """Parts as one surface, its reflectivity log-uniform between two values."""
    return Surface(np.concatenate(parts), label, log_uniform(reflectivity, generator))


def spotted(
    triangles: Triangles, reflectivity: Span, spread: float, generator: Generator
) -> Surface:
    """A surface of the background whose reflectivity differs from triangle to triangle.

    Args:
        triangles: The surface.
        reflectivity: Of the whole, log-uniform between two values.
        spread: Standard deviation of its logarithm.
        generator: Random generator.
    """
    usual = log_uniform(reflectivity, generator)
    spots = usual * np.exp(generator.normal(0, spread, len(triangles)))
    return Surface(triangles, BACKGROUND, np.clip(spots, 0.003, 1))


def asphalt(x: tuple[float, float], y: tuple[float, float], generator: Generator) -> Surface:
    """A patch of road, from dry asphalt to a film of water that mirrors most of the light away."""
    return of_material([shapes.rectangle(x, y, 0)], (0.01, 0.2), generator, TrackClass.ROAD)


def ground(x: tuple[float, float], y: tuple[float, float], generator: Generator) -> Surface:
    """The ground under and beside the road, a centimetre lower so that the road is on top."""
    plane = shapes.rectangle(x, y, -0.01)
    return Surface(plane, BACKGROUND, generator.uniform(0.05, 0.3))


def car(generator: Generator) -> Surface:
    """A car, from black paint to white."""
    length, width = generator.uniform(3.9, 4.9), generator.uniform(1.7, 1.95)
    bonnet, roof = generator.uniform(0.75, 0.95), generator.uniform(1.4, 1.8)
    profile = np.array([[-0.48, bonnet], [0.22, bonnet], [0.05, roof], [-0.4, roof]])
    cabin = shapes.prism(profile * (length, 1), -0.42 * width, 0.42 * width)
    body = shapes.box(length, width, 0.25, bonnet)
    whole = np.concatenate([body, shapes.on_its_side(cabin)])
    return Surface(whole, TrackClass.CAR, generator.uniform(0.02, 0.6))


def pedestrian(generator: Generator) -> Surface:
    """A standing child or adult."""
    height = generator.uniform(1.1, 1.9)
    legs = [shapes.cylinder(0.08, 0, 0.48 * height, at=(0, y)) for y in (-0.1, 0.1)]
    torso = shapes.cylinder(0.2, 0.48 * height, 0.84 * height)
    head = shapes.cylinder(0.1, 0.86 * height, height)
    whole = np.concatenate([*legs, torso, head])
    return Surface(whole, TrackClass.PEDESTRIAN, generator.uniform(0.03, 0.5))


def bike(generator: Generator) -> Surface:
    """A bicycle with its rider."""
    wheel = shapes.raised(shapes.on_its_side(shapes.cylinder(0.34, -0.02, 0.02)), 0.34)
    wheels = [shapes.placed(wheel, x, 0) for x in (-0.52, 0.52)]
    frame = shapes.box(0.9, 0.05, 0.5, 0.62)
    rider = [shapes.cylinder(0.17, 0.8, 1.5), shapes.cylinder(0.1, 1.52, 1.75)]
    whole = np.concatenate([*wheels, frame, *rider])
    return Surface(whole, TrackClass.BIKE, generator.uniform(0.03, 0.5))


def target(generator: Generator) -> Surface:
    """A calibration plate on a stand, facing the sensor: black, grey or white."""
    width, bottom = generator.uniform(0.5, 1.2), generator.uniform(0.3, 1.0)
    plate = shapes.box(0.03, width, bottom, bottom + width)
    stand = shapes.cylinder(0.03, 0, bottom)
    whole = np.concatenate([plate, stand])
    return Surface(whole, TrackClass.TARGET, generator.choice([0.05, 0.1, 0.5, 0.9]))


def sprinkler(generator: Generator) -> Surface:
    """A mast with an arm towards the side −y."""
    height, arm = generator.uniform(3.0, 5.0), generator.uniform(1.0, 2.5)
    mast = shapes.cylinder(generator.uniform(0.04, 0.1), 0, height)
    pipe = shapes.box(0.06, arm, height - 0.06, height, at=(0, -arm / 2))
    foot = shapes.box(0.6, 0.6, 0, 0.25)
    whole = np.concatenate([mast, pipe, foot])
    return Surface(whole, TrackClass.SPRINKLER, generator.uniform(0.05, 0.5))


def sprinklers(places: Floats, aside: float, generator: Generator) -> Surfaces:
    """Sprinklers on both sides of the x axis, so far from it, at places along it, metres."""
    for x in places:
        yield sprinkler(generator).placed(x, aside)
        yield sprinkler(generator).placed(x, -aside, np.pi)


def pole(generator: Generator) -> Surface:
    """A thin post: of a fence, a sign or a lamp."""
    post = shapes.cylinder(generator.uniform(0.01, 0.06), 0, generator.uniform(0.8, 6.0))
    return Surface(post, BACKGROUND, generator.uniform(0.02, 0.5))


def trunk(generator: Generator) -> Surface:
    """The trunk of a tree."""
    stem = shapes.cylinder(generator.uniform(0.08, 0.25), 0, 3)
    return Surface(stem, BACKGROUND, generator.uniform(0.05, 0.3))


def tree(crown: float, generator: Generator) -> Surfaces:
    """A tree with a round crown of a radius in metres."""
    yield trunk(generator)
    yield foliage((crown, crown, crown), 2 + crown, generator)


def bough(largest: float, generator: Generator) -> Surface:
    """Foliage overhead with half-axes of 0.3 m or more.

    Args:
        largest: Upper limit of a half-axis, metres.
        generator: Random generator.
    """
    length, width, height = generator.uniform(0.3, largest, 3)
    return foliage((length, width, height), generator.uniform(1.5, 3), generator)


def building(generator: Generator) -> Surface:
    """A flat-roofed building."""
    length, width = generator.uniform(5, 15), generator.uniform(10, 40)
    walls = shapes.box(length, width, 0, generator.uniform(3, 9))
    return Surface(walls, BACKGROUND, generator.uniform(0.1, 0.6))


def foliage(radii: tuple[float, float, float], height: float, generator: Generator) -> Surface:
    """Leaves and twigs in an ellipsoid: many small, scattered returns, most of them weak.

    A ray hits a leaf or misses it, while a beam is often filled by it only in part; hence the wide
    spread of reflectivity, down to that of a rain drop.

    Args:
        radii: Half-axes of the ellipsoid, metres.
        height: Height of its centre, metres.
        generator: Random generator.
    """
    surface_area = radii[0] * radii[1] + radii[1] * radii[2] + radii[2] * radii[0]
    count = int(generator.uniform(30, 250) * surface_area)
    leaves = shapes.leaves(shapes.inside_ellipsoid(count, radii, generator), 0.02, generator)
    reflectivity = log_uniforms((0.003, 0.4), count, generator)
    return Surface(shapes.raised(leaves, height), BACKGROUND, reflectivity)


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
        sensor: Place of the sensor, (3,), metres. Specks grow with distance, as beams widen, so
            that they still return them.
        count: Their number.
        generator: Random generator.

    Returns:
        At most ``count``; those that would be too near to the sensor are left out.
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


def mirrored(surface: Surface, sensor: Floats, count: int, generator: Generator) -> Surfaces:
    """A surface with specks that mirrors the light away and hides the things behind it.

    Args:
        surface: The surface as it would be if it returned all over.
        sensor: Place of the sensor, (3,), metres.
        count: Number of specks.
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
