"""Particles in the beams of a sensor: a Poisson process in space, drawn where beams are alone."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.random import Generator

from derain.scan import Bools, Floats, Ints
from derain.simulation.arrays import Columns
from derain.simulation.flying.optics import Optics, Sizes, Slices
from derain.system.cores import sleeping_threads

with sleeping_threads():
    import small_gicp

# Beams looked up around every particle at first; where all of them meet it, more are.
FIRST_LOOK = 6
GROWTH = 5

# Pairs of a particle and a beam that are looked at in one go: 64 MB of them.
PAIRS_AT_ONCE = 2**22


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


@dataclass(frozen=True, eq=False)
class Meetings(Columns):
    """Pairs of particles and the beams that meet them; each may be in several pairs.

    Attributes:
        particle: Row of the particle, int64 (M,).
        beam: Row of the beam, int64 (M,).
        offset: Distance of the particle's centre from the beam's axis, float64 (M,), metres.
    """

    particle: Ints
    beam: Ints
    offset: Floats


@dataclass(frozen=True, eq=False)
class Stretch:
    """The part of each beam where particles of some kind may be.

    Attributes:
        near: Begin of the stretch, float64 (N,), metres.
        far: End of the stretch, float64 (N,), metres; before ``near`` where the beam has none.
    """

    near: Floats
    far: Floats

    def holds(self, beam: Ints, distance: Floats) -> Bools:
        """True if places on beams, by their distances in metres, are on it, bool (M,)."""
        return np.asarray((self.near[beam] <= distance) & (distance <= self.far[beam]))


@dataclass(frozen=True, eq=False)
class OpenBeams:
    """Beams in front of the surfaces that end them, to be found by their direction.

    Attributes:
        directions: Unit vectors along them, float64 (N, 3), sensor frame.
        stretch: From the minimum range to the surfaces.
        optics: Optics of the sensor for particles in them.
    """

    directions: Floats
    stretch: Stretch
    optics: Optics

    def meetings(self, particles: Particles) -> Meetings:
        """Finds the beams that touch particles, none of them at the origin.

        Returns:
            In order of the particles; the distances are chords, which for the small angles between
            neighbouring beams are the distances from the axes.
        """
        within = (self.optics.width(particles.range) + particles.diameter) / 2
        found = [Meetings(np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0))]
        rows, count = np.arange(len(within)), FIRST_LOOK
        while len(rows):
            count = min(count, len(self.directions))
            more = []
            for part in np.array_split(rows, 1 + len(rows) * count // PAIRS_AT_ONCE):
                offset, beam = self.nearest(particles.place[part], count)
                close = offset < within[part, None]
                whole = ~close[:, -1] | (count == len(self.directions))
                row, column = np.nonzero(close & whole[:, None])
                found.append(Meetings(part[row], beam[row, column], offset[row, column]))
                more.append(part[~whole])
            rows, count = np.concatenate(more), GROWTH * count
        meetings = Meetings.joined(found)
        return meetings.take(np.argsort(meetings.particle, kind="stable"))

    def nearest(self, place: Floats, count: int) -> tuple[Floats, Ints]:
        """The beams whose axes pass places nearest, the nearest first.

        Args:
            place: Places, float64 (P, 3), sensor frame, metres.
            count: Beams for each of them.

        Returns:
            Distances of the axes, float64 (P, count), metres, and rows, int64 (P, count).
        """
        far = np.linalg.norm(place, axis=1, keepdims=True)
        # One thread, so that beams at the same distance come in the same order every time.
        beam, squared = self._tree.batch_knn_search(place / far, count, num_threads=1)
        return np.sqrt(squared) * far, beam.astype(np.int64)

    @cached_property
    def _tree(self) -> Any:
        return small_gicp.KdTree(np.ascontiguousarray(self.directions), num_threads=1)


def draw_particles(
    number: float, sizes: Sizes, stretch: Stretch, beams: OpenBeams, generator: Generator
) -> tuple[Particles, Meetings]:
    """Draws particles of an even density on the stretches of the beams.

    Particles are drawn for each beam as if it were alone, so a particle within several beams is
    drawn for each of them. It is kept only for the nearest beam with a stretch at its place. The
    kept particles are the Poisson process of the space that the beams fill together.

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
    meetings = beams.meetings(particles)
    ahead = beams.stretch.holds(meetings.beam, particles.range[meetings.particle])
    return particles, meetings.take(ahead)


def _by_nearest(drawn: Particles, drawn_for: Ints, stretch: Stretch, beams: OpenBeams) -> Bools:
    """True for particles that were drawn for the nearest of their possible beams."""
    _, nearest = beams.nearest(drawn.place, 1)
    nearest = nearest[:, 0]
    kept = nearest == drawn_for
    # Where the nearest of all could not draw it, such as behind a surface, another one counts.
    unsettled = np.flatnonzero(~stretch.holds(nearest, drawn.range) & ~kept)
    rest = drawn.take(unsettled)
    meetings = beams.meetings(rest)
    meetings = meetings.take(stretch.holds(meetings.beam, rest.range[meetings.particle]))
    # From the farthest to the nearest: of several beams the last assigned stays.
    outwards = np.argsort(-meetings.offset, kind="stable")
    best = drawn_for[unsettled].copy()
    best[meetings.particle[outwards]] = meetings.beam[outwards]
    kept[unsettled] = best == drawn_for[unsettled]
    return np.asarray(kept)


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
    # Uniform in the disc at the slice's far end; where the beam is narrower, it covers less of it.
    offset = np.sqrt(generator.random(len(rows))) * (np.concatenate(bound) + size) / 2
    turn = generator.uniform(0, 2 * np.pi, len(rows))
    inside = (offset < (optics.width(along) + size) / 2) & stretch.holds(rows, along)
    inside &= size >= optics.smallest_visible(along)
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
