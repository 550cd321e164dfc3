"""Vehicles with windows that rays go through, and with what is behind them: seats, a driver."""

from collections.abc import Iterator

import numpy as np
from numpy.random import Generator

from derain.simulation import shapes
from derain.simulation.arrays import Floats
from derain.simulation.classes import TrackClass
from derain.simulation.objects import Surface, of_material
from derain.simulation.places.walls import pane
from derain.simulation.shapes import Triangles, bars

BODYWORK = (0.02, 0.7)
CAR_GLASS = (0.01, 0.15)
CLOTH = (0.05, 0.5)
RUBBER = (0.02, 0.1)


def glazed_car(generator: Generator) -> Iterator[Surface]:
    """A car along x, from a small one to a van: body, pillars, roof, windows, seats, mirrors."""
    length, width = generator.uniform(3.4, 5.4), generator.uniform(1.6, 2.0)
    sill, roof = generator.uniform(0.8, 1.1), generator.uniform(1.4, 2.1)
    clearance = generator.uniform(0.15, 0.3)
    body = shapes.box(length, width, clearance, sill)
    cabin = _cabin(length, width, sill, roof, generator)
    pillars = shapes.rods(cabin[0], cabin[1], 0.04, sides=4)
    top = shapes.sheet(np.stack([cabin[1][[0, 1]], cabin[1][[3, 2]]]))
    mirrors = [
        shapes.box(0.08, 0.2, sill, sill + 0.16, at=(0.2 * length, y))
        for y in (-width / 2, width / 2)
    ]
    antenna = bars([((-0.2 * length, 0, roof), (-0.3 * length, 0, roof + 0.4))], 0.005)
    painted = [body, pillars, top, *mirrors, antenna]
    yield of_material(painted, BODYWORK, generator, TrackClass.CAR)
    yield of_material(_panes(cabin, generator), CAR_GLASS, generator, TrackClass.CAR)
    yield of_material([_seats(length, width, sill, generator)], CLOTH, generator, TrackClass.CAR)
    yield of_material([_wheels(0.31 * length, width)], RUBBER, generator, TrackClass.CAR)


def lorry(generator: Generator) -> Iterator[Surface]:
    """A lorry along x: a cab with windows, a box with a wavy tarpaulin, an open chassis."""
    length, width, top = generator.uniform(5, 13), 2.5, generator.uniform(2.8, 4.0)
    cab = shapes.box(1.8, 2.4, 0.5, 1.6, at=(length / 2 + 1.1, 0))
    roof = shapes.box(1.8, 2.4, 2.5, 2.6, at=(length / 2 + 1.1, 0))
    foot = np.array([[-0.9, -1.2, 1.6], [0.9, -1.2, 1.6], [0.9, 1.2, 1.6], [-0.9, 1.2, 1.6]])
    foot += (length / 2 + 1.1, 0, 0)
    head = shapes.raised(foot, 0.9)
    pillars = shapes.rods(foot, head, 0.05, sides=4)
    yield of_material([cab, roof, pillars], BODYWORK, generator, TrackClass.CAR)
    yield of_material(_panes((foot, head), generator), CAR_GLASS, generator, TrackClass.CAR)
    sides = [_tarpaulin(length, y, top, generator) for y in (-width / 2, width / 2)]
    ends = [shapes.box(0.05, width, 1.1, top, at=(x, 0)) for x in (-length / 2, length / 2)]
    bed = shapes.box(length, width, 1.0, 1.15)
    lid = shapes.box(length, width, top, top + 0.03)
    yield of_material([*sides, *ends, bed, lid], BODYWORK, generator, TrackClass.CAR)
    frame = [((-length / 2, y, 0.8), (length / 2, y, 0.8)) for y in (-0.4, 0.4)]
    frame += [((-0.2 * length, y, 0.55), (0.2 * length, y, 0.55)) for y in (-1.2, 1.2)]
    frame += [((-length / 2, -1.1, 0.5), (-length / 2, 1.1, 0.5))]
    yield of_material([bars(frame, 0.06)], RUBBER, generator, TrackClass.CAR)
    yield of_material([_wheels(0.4 * length, width, 0.5)], RUBBER, generator, TrackClass.CAR)


def _cabin(
    length: float, width: float, sill: float, roof: float, generator: Generator
) -> tuple[Floats, Floats]:
    """Lower and upper ends of the four pillars, from the right at the rear on, (4, 3) both."""
    rear, front = -generator.uniform(0.3, 0.49), generator.uniform(0.18, 0.32)
    half, lean = 0.46 * width, generator.uniform(0.03, 0.16)
    foot = np.array([[rear, -1, sill], [front, -1, sill], [front, 1, sill], [rear, 1, sill]])
    head = foot + np.array([[0.4, 0.1, 0], [-1, 0.1, 0], [-1, -0.1, 0], [0.4, -0.1, 0]]) * lean
    head[:, 2] = roof
    return foot * (length, half, 1), head * (length, half, 1)


def _panes(cabin: tuple[Floats, Floats], generator: Generator) -> list[Triangles]:
    """A pane on every side of a cabin; one of them may be open."""
    foot, head = cabin
    after = np.roll(foot, -1, axis=0), np.roll(head, -1, axis=0)
    return [pane(side, generator) for side in np.stack([foot, *after, head], axis=1)]


def _seats(length: float, width: float, sill: float, generator: Generator) -> Triangles:
    """Backs and headrests, a wheel to steer, and perhaps who sits there."""
    parts = []
    for x in (0.02 * length, -0.2 * length):
        for y in (-0.22 * width, 0.22 * width):
            parts.append(shapes.box(0.1, 0.45, 0.5, sill + 0.05, at=(x, y)))
            parts.append(shapes.box(0.07, 0.2, sill + 0.1, sill + 0.28, at=(x, y)))
            if generator.random() < 0.25:
                parts.append(shapes.cylinder(0.17, 0.5, sill + 0.12, at=(x + 0.2, y)))
                parts.append(shapes.cylinder(0.09, sill + 0.15, sill + 0.38, at=(x + 0.2, y)))
    x, y = 0.14 * length, 0.22 * width
    parts.append(bars([((x, y - 0.18, sill), (x, y + 0.18, sill + 0.02))], 0.02))
    return np.concatenate(parts)


def _wheels(axle: float, width: float, radius: float = 0.32) -> Triangles:
    wheel = shapes.raised(shapes.on_its_side(shapes.cylinder(radius, -0.1, 0.1)), radius)
    places = [(x, y) for x in (-axle, axle) for y in (-0.5 * width + 0.08, 0.5 * width - 0.08)]
    return np.concatenate([shapes.placed(wheel, x, y) for x, y in places])


def _tarpaulin(length: float, y: float, top: float, generator: Generator) -> Triangles:
    x = np.linspace(-length / 2, length / 2, int(length / 0.15))
    z = np.linspace(1.15, top, 6)
    corners = shapes.upright_grid(x, z, y)
    corners[..., 1] += generator.uniform(0, 0.04) * np.sin(generator.uniform(2, 12) * x)[:, None]
    return shapes.sheet(corners)
