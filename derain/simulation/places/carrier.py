"""The carrier that a sensor sees under itself: a car, a lorry, a robot, a tripod, a mast.

Its parts are seen from .15 to 3 m, most of them at grazing angles or with paint that mirrors the
light away. Much of a carrier therefore returns a few scattered points, or none, but still hides the
things behind it.
"""

from collections.abc import Iterator
from itertools import islice

import numpy as np
from numpy.random import Generator

from derain.simulation import shapes
from derain.simulation.classes import TrackClass
from derain.simulation.drawing import Span, log_uniform, pick
from derain.simulation.objects import PAINT, Surface, Surfaces, mirrored
from derain.simulation.shapes import Point, Triangles, bars

# Number of specks of a part that returns nothing else.
SPECKS_OF_A_CARRIER = (1.0, 100.0)

# Share of the parts of a carrier with paint that returns everywhere; half of the carriers have
# none.
PAINTED = (0.0, 0.0, 0.25, 0.6)

# A sensor is mounted on a car from so high on, and on a lorry, metres.
ON_A_CAR, ON_A_LORRY = 1.3, 2.4

# Parts in the sensor's own upright frame.
Parts = Iterator[Triangles]


def lay_out_carrier(generator: Generator, mounting_height: float) -> Surfaces:
    """Lays out what carries the sensor; nothing for every fifth sensor.

    It is upright under the sensor, whichever way the sensor itself is tilted. A sensor that moves
    takes it along: ``Track.of(...)`` of it is then cast by itself, without a pose, and of the two
    returns of each beam the nearer counts.

    Args:
        generator: Random generator.
        mounting_height: Height of the sensor above the ground, metres.

    Yields:
        Surfaces of the background in the frame of a track, with the origin on the ground under the
        sensor; none is nearer to the sensor than .1 m.
    """
    if generator.random() < 0.2:
        return
    shares = CARRIERS_BY_HEIGHT[int(np.searchsorted([ON_A_CAR, ON_A_LORRY], mounting_height))]
    carrier = pick(shares, generator)
    heading = generator.choice([0.0, generator.normal(0, 0.1), generator.uniform(-np.pi, np.pi)])
    painted = generator.choice(PAINTED)
    for part in carrier(generator, mounting_height):
        standing = shapes.raised(shapes.placed(part, 0, 0, heading), mounting_height)
        surface = Surface(standing, TrackClass.BACKGROUND, log_uniform(PAINT, generator))
        if generator.random() < painted:
            yield surface
            continue
        # What is no paint is a mirror with specks on it, or the specks alone.
        count = round(log_uniform(SPECKS_OF_A_CARRIER, generator))
        shining = mirrored(surface, np.array([0, 0, mounting_height]), count, generator)
        hides = generator.random() < 0.7
        yield from shining if hides else islice(shining, 1, None)


def _car(generator: Generator, mounting_height: float) -> Parts:
    """A roof with rack and antenna under the sensor, windscreen, bonnet, boot and mirrors."""
    drop = log_uniform((0.2, min(0.9, mounting_height - 1.0)), generator)
    half = generator.uniform(0.5, 0.75)
    rear, front = -generator.uniform(0.3, 2.0), generator.uniform(0.3, 1.4)
    yield _vaulted((rear, front), half, -drop, generator)
    sill = -drop - generator.uniform(0.4, 0.6)
    slope = generator.uniform(0.5, 0.9)
    yield _between((front, half, -drop - 0.03), (front + slope, 1.1 * half, sill))
    yield _vaulted((front + slope, front + slope + 1.1), 1.15 * half, sill, generator)
    yield _between((rear, half, -drop - 0.03), (rear - 0.5, 1.1 * half, sill))
    for side in (-1, 1):
        top, at = sill + generator.uniform(0.12, 0.2), (front + 0.3, side * (half + 0.3))
        yield shapes.box(0.15, 0.25, sill, top, at)
    yield from _rack((rear, front), half, -drop, generator)
    yield from _antenna(rear + 0.1, -drop, generator)
    yield from _equipment((0.25, 1.6), -drop, generator)


def _lorry(generator: Generator, mounting_height: float) -> Parts:
    """A cab's roof with a deflector, mirrors on arms, lamps, and the front of a box behind."""
    drop = log_uniform((0.2, 1.2), generator)
    rear, front, half = -generator.uniform(0.5, 1.5), generator.uniform(0.2, 0.8), 1.2
    yield _vaulted((rear, front), half, -drop, generator)
    top = generator.uniform(-0.1, 0.9)
    if rear < -0.6:
        yield shapes.box(0.4, 2 * half, -drop - 1, top, at=(rear - 0.3, 0))
    for side in (-1, 1):
        y = side * (half + generator.uniform(0.1, 0.4))
        yield shapes.box(0.12, 0.3, -drop - 0.8, -drop - 0.2, at=(front + 0.3, y))
        yield bars([((front, side * half, -drop - 0.1), (front + 0.3, y, -drop - 0.2))], 0.02)
        yield shapes.cylinder(0.06, -drop, -drop + 0.15, at=(front - 0.1, side * 0.8))
    yield from _rack((rear, front), half, -drop, generator)
    yield from _antenna(front - 0.2, -drop, generator)
    yield from _equipment((0.25, 2.0), -drop, generator)


def _robot(generator: Generator, mounting_height: float) -> Parts:
    """A flat deck with posts at its corners, plates over them, cables, an arm, wheels."""
    drop = log_uniform((0.18, max(0.2, 0.8 * mounting_height)), generator)
    drop = max(min(drop, mounting_height - 0.02), 0.17)
    half_length, half_width = generator.uniform(0.25, 0.7), generator.uniform(0.2, 0.45)
    yield shapes.box(2 * half_length, 2 * half_width, -drop - 0.03, -drop)
    head = generator.uniform(-0.1, 0.35)
    for x in (-half_length, half_length):
        for y in (-half_width, half_width):
            if generator.random() < 0.6:
                radius = generator.uniform(0.006, 0.025)
                yield shapes.cylinder(radius, -drop, head, at=(0.95 * x, 0.95 * y))
    if generator.random() < 0.3:
        yield shapes.box(2 * half_length, 2 * half_width, 0.25, 0.27)
    for y in (-half_width, half_width):
        yield shapes.box(1.2 * half_length, 0.1, -drop - 0.2, -drop, at=(0, 1.2 * y))
    yield from _equipment((0.2, max(half_length, 0.4)), -drop, generator)


def _tripod(generator: Generator, mounting_height: float) -> Parts:
    """Three legs, what hangs between them, and somebody behind or a hand that holds the sensor."""
    floor = -mounting_height
    spread, radius = generator.uniform(0.25, 0.7), generator.uniform(0.01, 0.025)
    for angle in generator.uniform(0, 2 * np.pi) + np.arange(3) * (2 * np.pi / 3):
        x, y = spread * np.cos(angle), spread * np.sin(angle)
        leg = (0.05 * x, 0.05 * y, -0.2), (x, y, min(0.05 - mounting_height, -0.25))
        yield bars([leg], radius, 6)
    for _ in range(generator.integers(0, 3)):
        yield _loop((0.2, 0.5), -0.3, generator)
    if generator.random() < 0.7:
        behind, height = generator.uniform(0.35, 1.5), generator.uniform(1.5, 1.95)
        angle = np.pi + generator.normal(0, 0.4)
        x, y = behind * np.cos(angle), behind * np.sin(angle)
        for low, high, wide in ((0.0, 0.48, 0.12), (0.45, 0.84, 0.17), (0.86, 1.0, 0.1)):
            yield shapes.cylinder(wide, floor + low * height, floor + high * height, at=(x, y))
        if behind < 0.8:
            arm = (x, y, floor + 0.78 * height), (0.25 * x, 0.25 * y, -0.2)
            yield bars([arm], 0.04, 6)
    yield from _equipment((0.2, 0.8), -0.35, generator)


def _mast(generator: Generator, mounting_height: float) -> Parts:
    """A pole under the sensor or beside it, brackets, cables, the rim of a housing."""
    aside = generator.choice([0.0, generator.uniform(0.25, 0.6)])
    top = -0.2 if aside == 0 else generator.uniform(-0.2, 1.0)
    yield shapes.cylinder(generator.uniform(0.03, 0.1), -mounting_height, top, at=(-aside, 0))
    yield shapes.box(0.3 + aside, 0.06, -0.24, -0.2, at=(-aside / 2, 0))
    yield from _equipment((0.25, 1.2), -0.3, generator)


def _rack(x: Span, half: float, roof: float, generator: Generator) -> Parts:
    """Rails along a roof and bars across it."""
    height = roof + generator.uniform(0.04, min(0.15, -roof - 0.12) if roof < -0.2 else 0.05)
    radius = generator.uniform(0.008, 0.03)
    if generator.random() < 0.7:
        across = generator.uniform(*x, generator.integers(1, 4))
        yield bars([((at, -half, height), (at, half, height)) for at in across], radius)
    if generator.random() < 0.5:
        yield bars([((x[0], y, height), (x[1], y, height)) for y in (-half, half)], radius)


def _antenna(x: float, roof: float, generator: Generator) -> Parts:
    if generator.random() < 0.7:
        x = x if abs(x) > 0.3 else -0.35
        y, length = generator.uniform(-0.3, 0.3), generator.uniform(0.08, 0.9)
        tip = x - np.copysign(generator.uniform(0, 0.5), -x) * length, y, roof + length
        yield bars([((x, y, roof), tip)], log_uniform((0.002, 0.015), generator), 6)


def _equipment(distance: Span, floor: float, generator: Generator) -> Parts:
    """Other sensors, lamps, brackets, cables and rims about the sensor, below its horizon or above.

    Args:
        distance: Nearest and farthest, metres.
        floor: Height of the ground that they stand on, metres, in the sensor's frame.
        generator: Random generator.
    """
    for _ in range(generator.poisson(2.5)):
        angle, away = generator.uniform(-np.pi, np.pi), log_uniform(distance, generator)
        size = generator.uniform(0.02, 0.3) * min(1.0, away)
        top = max(floor + 0.03, generator.uniform(floor, 0.3 * away))
        things = [
            shapes.box(size, size, floor, top),
            shapes.cylinder(0.4 * size, floor, top),
            shapes.box(0.01, size, max(floor, top - 0.1), top),
        ]
        x, y = (away + size) * np.cos(angle), (away + size) * np.sin(angle)
        yield shapes.placed(things[generator.integers(3)], x, y, angle)
    for _ in range(generator.integers(0, 3)):
        yield _loop((max(distance[0], 0.2), distance[1]), floor, generator)
    if generator.random() < 0.4:
        yield _rim(generator)


def _loop(distance: Span, floor: float, generator: Generator) -> Triangles:
    """A cable that runs about the sensor, level or rising and falling."""
    angle = generator.uniform(-np.pi, np.pi) + np.linspace(0, generator.uniform(0.2, 2.5), 13)
    near, far = generator.uniform(*distance, 2)
    away = np.linspace(near, far, 13)
    height = floor + 0.02 + 0.15 * generator.random() * np.sin(np.linspace(0, np.pi, 13)) ** 2
    knots = np.column_stack([away * np.cos(angle), away * np.sin(angle), height])
    return shapes.rods(knots[:-1], knots[1:], log_uniform((0.002, 0.012), generator))


def _rim(generator: Generator) -> Triangles:
    """A sector of a ring about the sensor: the frame of a window or the edge of a hood."""
    begin, sector = generator.uniform(-np.pi, np.pi), generator.uniform(0.3, 2.5)
    angle = begin + np.linspace(0, sector, 25)
    away, tilt = log_uniform((0.2, 0.9), generator), generator.uniform(-0.25, 0.3)
    wave = generator.uniform(0, 0.1) * np.sin(3 * angle + begin)
    rows = []
    for up in (0.0, generator.uniform(0.01, 0.15)):
        height = away * (tilt + wave + up)
        rows.append(np.column_stack([away * np.cos(angle), away * np.sin(angle), height]))
    return shapes.sheet(np.stack(rows))


def _vaulted(x: Span, half: float, top: float, generator: Generator) -> Triangles:
    """A roof or a bonnet, curved down towards its sides and ends."""
    along, aside = np.meshgrid(np.linspace(*x, 9), np.linspace(-half, half, 9), indexing="ij")
    from_middle = 2 * (along - sum(x) / 2) / (x[1] - x[0])
    bend = generator.uniform(0.01, 0.08, 2)
    height = top - bend[0] * (aside / half) ** 2 - bend[1] * from_middle**4
    return shapes.sheet(np.stack([along, aside, height], axis=-1))


def _between(upper: Point, lower: Point) -> Triangles:
    """A pane from one edge across the car to another one; each by its x, half width and height."""
    corners = [[(x, -half, z), (x, half, z)] for x, half, z in (upper, lower)]
    return shapes.sheet(np.array(corners))


CARRIERS_BY_HEIGHT = (
    {_robot: 0.55, _tripod: 0.4, _mast: 0.05},
    {_car: 0.7, _tripod: 0.1, _robot: 0.1, _mast: 0.1},
    {_lorry: 0.5, _car: 0.2, _mast: 0.3},
)
