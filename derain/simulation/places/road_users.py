"""People, cyclists and vehicles as a sensor meets them: striding, loaded, with open windows."""

from collections.abc import Iterable

import numpy as np
from numpy.random import Generator

from derain.scan import Floats
from derain.simulation import shapes
from derain.simulation.classes import TrackClass
from derain.simulation.drawing import log_uniform
from derain.simulation.objects import Surface, Surfaces, of_material
from derain.simulation.places.openwork import pane
from derain.simulation.shapes import Point, Triangles, bars

# Of cloth, which in the near infrared is anything from black to white.
PERSON_REFLECTIVITY = (0.03, 0.7)


def person(generator: Generator) -> Surface:
    """Somebody of 0.9 to 1.95 m who stands or strides along x, perhaps with something in hand."""
    height = generator.uniform(0.9, 1.95)
    parts = [_body(height, generator)]
    carried = CARRIED[generator.integers(len(CARRIED))]
    if carried and height > 1.4:
        parts.append(carried(height, generator))
    return _clothed(parts, TrackClass.PEDESTRIAN, generator)


def cyclist(generator: Generator) -> Surface:
    """A bicycle along x of thin tubes and spokes, mostly with its rider."""
    parts = [_wheel(x, generator) for x in (-0.52, 0.52)]
    frame = [
        ((-0.52, 0, 0.34), (-0.1, 0, 0.3)),
        ((-0.1, 0, 0.3), (-0.2, 0, 0.85)),
        ((-0.2, 0, 0.75), (0.4, 0, 0.8)),
        ((-0.1, 0, 0.3), (0.4, 0, 0.75)),
        ((0.4, 0, 0.95), (0.52, 0, 0.34)),
        ((0.4, -0.28, 1.0), (0.4, 0.28, 1.0)),
        ((-0.52, 0, 0.34), (-0.2, 0, 0.75)),
    ]
    parts.append(_limbs(frame, generator.uniform(0.014, 0.03)))
    if generator.random() < 0.75:
        rider = [((-0.2, y, 0.95), (0.1, y, 0.75)) for y in (-0.1, 0.1)]
        rider += [((0.1, y, 0.75), (-0.1, y, 0.3 + 0.2 * (y > 0))) for y in (-0.1, 0.1)]
        parts.append(_limbs(rider, 0.07))
        parts.append(_limbs([((-0.2, 0, 0.9), (0.12, 0, 1.45))], 0.16))
        parts.append(_limbs([((0.1, y, 1.4), (0.4, y, 1.02)) for y in (-0.18, 0.18)], 0.045))
        parts.append(shapes.cylinder(0.1, 1.52, 1.76, at=(0.18, 0)))
    return _clothed(parts, TrackClass.BIKE, generator)


def _body(height: float, generator: Generator) -> Triangles:
    """Legs, trunk, arms and head, whose proportions are a child's or an adult's."""
    hip, shoulder = 0.48 * height, 0.82 * height
    girth, stride = generator.uniform(0.75, 1.25), generator.uniform(0, 0.22) * height
    broad = 0.11 * height * girth
    legs, arms = [], []
    for side, ahead in ((-1, stride), (1, -stride)):
        knee = 0.5 * ahead + 0.04, side * 0.05 * height, 0.26 * height
        legs += [((0, side * 0.05 * height, hip), knee), (knee, (ahead, knee[1], 0.02))]
        swing, lift = generator.normal(-ahead, 0.15 * height), generator.uniform(0.4, 0.75)
        elbow = 0.5 * swing, side * (broad + 0.04), 0.64 * height
        hand = swing, side * (broad + generator.uniform(0, 0.12)), lift * height
        arms += [((0, side * broad, shoulder), elbow), (elbow, hand)]
    trunk = shapes.cylinder(1.0, hip - 0.03, shoulder) * (0.075 * height, broad, 1)
    head = shapes.cylinder(generator.uniform(0.08, 0.11), 0.85 * height, height)
    limbs = [_limbs(legs, 0.045 * height * girth), _limbs(arms, 0.025 * height * girth)]
    return np.concatenate([*limbs, trunk, head])


def _bag(height: float, generator: Generator) -> Triangles:
    bottom = generator.uniform(0.15, 0.3) * height
    return shapes.box(0.3, 0.1, bottom, bottom + 0.35, at=(0, -0.15 * height))


def _umbrella(height: float, generator: Generator) -> Triangles:
    radius, top = generator.uniform(0.35, 0.6), height + generator.uniform(0.1, 0.3)
    angle, out = np.linspace(0, 2 * np.pi, 9), np.linspace(0, 1, 4)[:, None]
    x, y = 0.2 + radius * out * np.cos(angle), radius * out * np.sin(angle)
    dome = np.stack(np.broadcast_arrays(x, y, top - 0.25 * out**2), axis=-1)
    stick = _limbs([((0.2, 0, 0.6 * height), (0.2, 0, top))], 0.01)
    return np.concatenate([shapes.sheet(dome), stick])


def _pushchair(height: float, generator: Generator) -> Triangles:
    ahead = generator.uniform(0.5, 0.7)
    seat = shapes.box(0.5, 0.4, 0.35, 0.7, at=(ahead + 0.25, 0))
    tubes = [((ahead - 0.35, y, 1.0), (ahead + 0.5, y, 0.1)) for y in (-0.22, 0.22)]
    tubes += [((ahead, y, 0.1), (ahead + 0.2, y, 0.7)) for y in (-0.22, 0.22)]
    return np.concatenate([seat, _limbs(tubes, 0.015)])


def _stick(height: float, generator: Generator) -> Triangles:
    """A walking stick, a spade or a pole on a shoulder."""
    reach = generator.uniform(0.5, 1.2) * height
    lean = generator.normal(0, 0.5)
    foot = 0.2, 0.15 * height, 0.02
    return _limbs([(foot, (0.2 + lean * reach, 0.15 * height, 0.03 + reach))], 0.015)


def _dog(height: float, generator: Generator) -> Triangles:
    size, x = generator.uniform(0.25, 0.7), generator.uniform(0.6, 1.5)
    body = [((x, 0, 0.75 * size), (x + size, 0, 0.75 * size))]
    feet = [(x + a * size, b * size) for a in (0, 1) for b in (-0.12, 0.12)]
    legs = [((a, b, 0.7 * size), (a, b, 0.0)) for a, b in feet]
    head = [((x + size, 0, 0.8 * size), (x + 1.35 * size, 0, size))]
    leash = [((0.1, 0.15, 0.5 * height), (x + size, 0, 0.85 * size))]
    parts = (body, 0.16 * size), (legs, 0.05 * size), (head, 0.1 * size), (leash, 0.006)
    return np.concatenate([_limbs(ends, radius) for ends, radius in parts])


# What somebody has in hand; one of six has nothing.
CARRIED = (None, _bag, _umbrella, _pushchair, _stick, _dog)


def _wheel(x: float, generator: Generator) -> Triangles:
    angle = np.linspace(0, 2 * np.pi, 17)
    rim = np.column_stack([x + 0.34 * np.cos(angle), 0 * angle, 0.34 + 0.34 * np.sin(angle)])
    hub = np.broadcast_to((x, 0.0, 0.34), (len(angle), 3))
    spokes = shapes.rods(hub[:-1], rim[:-1], log_uniform((0.002, 0.006), generator))
    return np.concatenate([shapes.rods(rim[:-1], rim[1:], 0.02), spokes])


def _limbs(ends: Iterable[tuple[Point, Point]], radius: float) -> Triangles:
    return bars(ends, radius, sides=6, taper=0.75)


def _clothed(parts: list[Triangles], label: TrackClass, generator: Generator) -> Surface:
    """Every part of a reflectivity of its own."""
    shine = [log_uniform(PERSON_REFLECTIVITY, generator) for _ in parts]
    reflectivity = np.repeat(shine, [len(part) for part in parts])
    return Surface(np.concatenate(parts), label, reflectivity)


BODYWORK = (0.02, 0.7)
CAR_GLASS = (0.01, 0.15)
CLOTH = (0.05, 0.5)
RUBBER = (0.02, 0.1)


def glazed_car(generator: Generator) -> Surfaces:
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


def lorry(generator: Generator) -> Surfaces:
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
