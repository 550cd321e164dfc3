"""Particles in the beams of a sensor: a Poisson process in space, drawn where beams are alone."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.random import Generator

from derain.simulation.arrays import Bools, Columns, Floats, Ints
from derain.simulation.flying.beam_tree import BeamTree, Meetings
from derain.simulation.flying.sizes import Optics, Sizes, Slices


@dataclass(frozen=True, eq=False)
class Stretch:
    """The part of each beam where particles of some kind may be.

    Attributes:
        near: Where it begins, float64 (N,), metres.
        far: Where it ends, float64 (N,), metres; before ``near`` where the beam has none.
    """

    near: Floats
    far: Floats


@dataclass(frozen=True, eq=False)
class OpenBeams:
    """Beams in front of the surfaces that end them.

    Attributes:
        directions: Unit vectors along them, float64 (N, 3), sensor frame.
        stretch: From the minimum range to the surfaces.
        optics: What the sensor sees of particles in them.
    """

    directions: Floats
    stretch: Stretch
    optics: Optics

    @cached_property
    def tree(self) -> BeamTree:
        """The same beams, to be found by direction."""
        return BeamTree(self.directions)


@dataclass(frozen=True, eq=False)
class Particles(Columns):
    """Particles near beams.

    Attributes:
        place: Centres, float64 (P, 3), sensor frame, metres.
        diameter: Diameters, float64 (P,), metres.
    """

    place: Floats
    diameter: Floats

    @property
    def range(self) -> Floats:
        """Distance from the sensor, float64 (P,), metres."""
        return np.asarray(np.linalg.norm(self.place, axis=1))


def draw_particles(
    number: float, sizes: Sizes, stretch: Stretch, beams: OpenBeams, generator: Generator
) -> tuple[Particles, Meetings]:
    """Draws particles of an even density that beams meet where they may be.

    For each beam they are drawn as if it were alone; a particle within several beams so comes up
    for each of them. It is kept only for the nearest of those whose stretches it is on. What is
    kept is the Poisson process of the space that the beams fill together.

    Args:
        number: Particles per cubic metre.
        sizes: Their diameters.
        stretch: The part of each beam where they may be, in front of the surfaces.
        beams: The beams.
        generator: Random generator.

    Returns:
        The particles that would be seen in the middle of a beam, and all beams that meet them in
        front of the surfaces.
    """
    drawn, drawn_for = _drawn_beam_by_beam(number, sizes, stretch, beams, generator)
    particles = drawn.take(_by_nearest(drawn, drawn_for, stretch, beams))
    meetings = _meetings(particles, beams)
    return particles, meetings.take(_inside(beams.stretch, meetings, particles.range))


def _by_nearest(drawn: Particles, drawn_for: Ints, stretch: Stretch, beams: OpenBeams) -> Bools:
    """Which particles were drawn for the nearest of the beams that they could be drawn for."""
    if not len(drawn_for):
        return np.empty(0, np.bool_)
    distance, nearest = drawn.range, beams.tree.nearest(drawn.place)
    kept = nearest == drawn_for
    # Where the nearest of all could not draw it, such as behind a surface, another one counts.
    ended = (distance < stretch.near[nearest]) | (distance > stretch.far[nearest])
    unsettled = np.flatnonzero(ended & ~kept)
    rest = drawn.take(unsettled)
    meetings = _meetings(rest, beams)
    meetings = meetings.take(_inside(stretch, meetings, rest.range))
    # From the farthest to the nearest: of several beams the last assigned stays.
    outwards = np.argsort(-meetings.offset, kind="stable")
    best = drawn_for[unsettled].copy()
    best[meetings.particle[outwards]] = meetings.beam[outwards]
    kept[unsettled] = best == drawn_for[unsettled]
    return np.asarray(kept)


def _meetings(particles: Particles, beams: OpenBeams) -> Meetings:
    within = (beams.optics.width(particles.range) + particles.diameter) / 2
    return beams.tree.meetings(particles.place, within)


def _inside(stretch: Stretch, meetings: Meetings, distance: Floats) -> Bools:
    """Which meetings are on the stretch of their beam, bool (M,)."""
    at = distance[meetings.particle]
    return np.asarray((stretch.near[meetings.beam] <= at) & (at <= stretch.far[meetings.beam]))


def _drawn_beam_by_beam(
    number: float, sizes: Sizes, stretch: Stretch, beams: OpenBeams, generator: Generator
) -> tuple[Particles, Ints]:
    """Particles that each beam meets in its stretch, as if there were no other; and its row."""
    optics, used = beams.optics, stretch.far > stretch.near
    slices = Slices(float(stretch.near[used].min(initial=optics.farthest)), optics, sizes)
    beam, distance, diameter, bound = [], [], [], []
    for row, (near, far, met) in enumerate(zip(slices.near, slices.far, slices.met, strict=True)):
        passing = np.flatnonzero(used & (stretch.near < far) & (stretch.far > near))
        count = int(generator.poisson(number * met * len(passing)))
        if count:
            beam.append(passing[generator.integers(len(passing), size=count)])
            distance.append(generator.uniform(near, far, count))
            diameter.append(slices.draw_diameters(row, count, generator))
            bound.append(np.full(count, slices.width[row]))
    if not beam:
        return Particles(np.empty((0, 3)), np.empty(0)), np.empty(0, np.int64)
    rows, along, size = np.concatenate(beam), np.concatenate(distance), np.concatenate(diameter)
    # Uniform in the disc of the slice's far end, of which the beam has less where it is narrower.
    offset = np.sqrt(generator.random(len(rows))) * (np.concatenate(bound) + size) / 2
    turn = generator.uniform(0, 2 * np.pi, len(rows))
    inside = (
        (offset < (optics.width(along) + size) / 2)
        & (stretch.near[rows] <= along)
        & (along <= stretch.far[rows])
        & (size >= optics.smallest_visible(along))
    )
    rows = rows[inside]
    axis = beams.directions[rows]
    across = _across(axis, turn[inside]) * offset[inside, None]
    return Particles(along[inside, None] * axis + across, size[inside]), rows


def _across(beams: Floats, turn: Floats) -> Floats:
    """Unit vectors at right angles to beams, turned around them, float64 (N, 3)."""
    steep = np.abs(beams[:, 2]) > 0.9
    helper = np.where(steep[:, None], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    first = np.cross(beams, helper)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(beams, first)
    return np.asarray(np.cos(turn)[:, None] * first + np.sin(turn)[:, None] * second)
