"""Shapes of triangles: float64 arrays of shape (T, 3, 3), T triangles of 3 corners in metres."""

from collections.abc import Iterable

import numpy as np
from numpy.random import Generator

from derain.scan import Array, Bools, Floats

Triangles = Floats

# x and y, and x, y and z, metres.
Place = tuple[float, float]
ORIGIN = (0.0, 0.0)
Point = tuple[float, float, float]


def rectangle(x: tuple[float, float], y: tuple[float, float], height: float) -> Triangles:
    """A horizontal rectangle between two x and two y, at one height."""
    corners = np.array([[x[i], y[j], height] for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))])
    return corners[[[0, 1, 2], [0, 2, 3]]]


def prism(outline: Floats, bottom: float, top: float) -> Triangles:
    """A vertical prism with its ends closed.

    Args:
        outline: Corners of the convex base in order, (K, 2).
        bottom: Height of the lower end.
        top: Height of the upper end.
    """
    lower = np.column_stack([outline, np.full(len(outline), bottom)])
    upper = np.column_stack([outline, np.full(len(outline), top)])
    next_lower, next_upper = np.roll(lower, -1, axis=0), np.roll(upper, -1, axis=0)
    sides = [
        np.stack([lower, next_lower, next_upper], axis=1),
        np.stack([lower, next_upper, upper], axis=1),
    ]
    ends = [
        np.stack([np.broadcast_to(end[0], end[2:].shape), end[1:-1], end[2:]], axis=1)
        for end in (lower, upper)
    ]
    return np.concatenate(sides + ends)


def box(
    length: float, width: float, bottom: float, top: float, at: Place = ORIGIN, heading: float = 0.0
) -> Triangles:
    """A box about an upright axis at an x and a y, its length along x or a heading in radians."""
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * (length / 2, width / 2)
    return placed(prism(corners, bottom, top), *at, heading)


def cylinder(radius: float, bottom: float, top: float, at: Place = ORIGIN) -> Triangles:
    """A twelve-sided cylinder about an upright axis at an x and a y."""
    angle = np.arange(12) * (2 * np.pi / 12)
    outline = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    return placed(prism(outline, bottom, top), *at)


def on_its_side(triangles: Triangles) -> Triangles:
    """Turns a shape about the x axis so that its z axis lies along y."""
    return triangles[..., [0, 2, 1]] * (1, -1, 1)


def placed(triangles: Triangles, x: float, y: float, heading: float = 0.0) -> Triangles:
    """Turns a shape by a heading in radians about the z axis, then moves it to (x, y)."""
    cosine, sine = np.cos(heading), np.sin(heading)
    turn = np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]])
    return np.asarray(triangles @ turn + (x, y, 0))


def raised(triangles: Triangles, height: float) -> Triangles:
    """Moves a shape up by a height in metres."""
    return np.asarray(triangles + np.array([0, 0, height]))


def sloped(triangles: Triangles, ahead: float, left: float) -> Triangles:
    """Raises a shape by a share of its x and of its y, as on sloping ground."""
    return np.asarray(triangles @ np.array([[1, 0, ahead], [0, 1, left], [0, 0, 1]]))


def leaves(centres: Floats, size: float, generator: Generator) -> Triangles:
    """One small triangle, turned at random, about every centre.

    Args:
        centres: Centres in metres, (L, 3).
        size: Standard deviation of a corner's distance from the centre along an axis, metres.
        generator: Random generator.
    """
    return centres[:, None, :] + generator.normal(0, size, (len(centres), 3, 3))


def inside_ellipsoid(count: int, radii: tuple[float, float, float], generator: Generator) -> Floats:
    """Points uniform in an ellipsoid about the origin, (count, 3), metres.

    Args:
        count: Their number.
        radii: Half-axes along x, y and z, metres.
        generator: Random generator.
    """
    direction = generator.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return direction * np.cbrt(generator.random((count, 1))) * radii


def sheet(corners: Floats) -> Triangles:
    """A surface through a grid of corners, two triangles for each of its cells.

    Args:
        corners: Float64 (M, N, 3), metres.
    """
    return quads(corners[:-1, :-1], corners[1:, :-1], corners[1:, 1:], corners[:-1, 1:])


def upright_grid(x: Floats, z: Floats, y: float = 0.0) -> Floats:
    """Corners of a sheet in a plane upright along x, (M, N, 3), from (M,) x and (N,) z, metres."""
    return np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1)[:, 0]


def quads(first: Floats, second: Floats, third: Floats, fourth: Floats) -> Triangles:
    """Quadrangles by their corners in order, float64 (..., 3) each: two triangles for each."""
    halves = np.stack([first, second, third, first, third, fourth], axis=-2)
    return halves.reshape(-1, 3, 3)


def rods(
    starts: Floats, ends: Floats, radius: float, taper: float = 1.0, sides: int = 3
) -> Triangles:
    """Thin straight rods without caps.

    Args:
        starts: Begin of each, (R, 3), metres.
        ends: End of each, elsewhere, (R, 3), metres.
        radius: From axis to edge at the start of each, metres.
        taper: Radius at the end over that at the start.
        sides: Sides of each.
    """
    first, second = across(ends - starts)
    angle = np.arange(sides) * (2 * np.pi / sides)
    ring = np.cos(angle)[:, None] * first[:, None] + np.sin(angle)[:, None] * second[:, None]
    ring *= radius
    lower, upper = starts[:, None] + ring, ends[:, None] + taper * ring
    following = (np.arange(sides) + 1) % sides
    return quads(lower, lower[:, following], upper[:, following], upper)


def bars(
    ends: Iterable[tuple[Point, Point]], radius: float, sides: int = 4, taper: float = 1.0
) -> Triangles:
    """Rods of one thickness from point to point; arguments as for :func:`rods`."""
    both = np.array(list(ends), np.float64)
    return rods(both[:, 0], both[:, 1], radius, taper, sides)


def blades(starts: Floats, ends: Floats, width: float, generator: Generator) -> Triangles:
    """One flat triangle from each start, where it is wide, to a point: a blade of grass, a twig.

    Args:
        starts: Begin of each, (B, 3), metres.
        ends: End of each, elsewhere, (B, 3), metres.
        width: At the start of each, metres.
        generator: Turns each about its length.
    """
    first, second = across(ends - starts)
    angle = generator.uniform(0, np.pi, (len(starts), 1))
    aside = width / 2 * (np.cos(angle) * first + np.sin(angle) * second)
    return np.stack([starts - aside, starts + aside, ends], axis=1)


def across(along: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors at right angles to each vector and to each other, (R, 3) both.

    Args:
        along: Vectors other than 0, (R, 3).
    """
    x, y, z = along.T
    length = np.sqrt(x * x + y * y + z * z)
    upright, nothing = np.abs(z) > 0.9 * length, np.zeros_like(x)
    # Across the z axis, or across the x axis where the vector is almost along z.
    first = np.where(upright, [nothing, z, -y], [y, -x, nothing])
    a, b, c = first = first / np.sqrt((first * first).sum(axis=0))
    second = np.stack([y * c - z * b, z * a - x * c, x * b - y * a]) / length
    return first.T, second.T


def clear_of_axis(triangles: Array, clearance: float) -> Bools:
    """True if a triangle, seen from above, is farther from the z axis than a clearance, bool (T,).

    Args:
        triangles: Corners, (T, 3, 3), metres.
        clearance: Metres.
    """
    level = triangles[..., :2]
    lowest, greatest = level.min(axis=1), level.max(axis=1)
    about = ((lowest < clearance) & (greatest > -clearance)).all(axis=1)
    first = level[about]
    second = np.roll(first, -1, axis=1)
    edge = second - first
    length = np.maximum((edge * edge).sum(axis=-1), np.finfo(float).tiny)
    share = np.clip(-(first * edge).sum(axis=-1) / length, 0, 1)
    x, y = np.moveaxis(first + share[..., None] * edge, -1, 0)
    turn = first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]
    around = (turn > 0).all(axis=1) | (turn < 0).all(axis=1)  # the axis goes through it
    clear = ~about
    clear[about] = (np.hypot(x, y) > clearance).all(axis=1) & ~around
    return np.asarray(clear)
