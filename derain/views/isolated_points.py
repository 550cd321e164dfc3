"""The view of isolated points: those of a scan that may be rain, each with its neighbours.

Most points of a scan are crowded by others, and no rain. They are recognised by what lies near them
along a Morton curve, before any search; a network judges the others alone, and they are what it
takes its time for.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np

from derain.files.documents import Entry
from derain.scan import Array, Float32s, Floats, Ints, Scan
from derain.views.channels import Channels, FillValues
from derain.views.intensity_rank import INTENSITY_RANKS, edges_reached, intensity_rank
from derain.views.merged_points import are_one_return, merged_points
from derain.views.morton import distinct_rows
from derain.views.neighbour_search import NeighbourSearch
from derain.views.neighbours import ViewedPoints, neighbours_at
from derain.views.view import VIEWS, View

# A point is isolated if no more than this crowds it, see :func:`crowding`. A quarter of a scan is,
# and 97.5 % of the rain and snow in simulated worlds.
# Source: modelling choice, on simulated worlds.
MOST_CROWDED = 6.5

# The step of a scan is the median over this many of its points, evenly along their curve.
SAMPLED = 8192

# A step is the angle within which this many of a point's neighbours lie, the nearest ones: two on
# either side along the axis of finer resolution, and one across it.
STEP_NEIGHBOURS = 3

# The least step, radians, and the step of a scan of too few points.
FINEST_STEP, USUAL_STEP = 1e-4, 0.1

# Nothing is measured nearer than this, metres; it keeps every division finite.
NEAREST_POINT = 0.05

# Points before and after one along the curve that may crowd it, and the distance at which one
# counts half, steps.
WINDOW, HALF_AT = 8, 2.0

# What the view takes of a point besides the rank of its intensity.
CHANNELS = ("x", "y", "z")

# Shells around the sensor in which points are counted: equal steps of the logarithm of range
# between these, metres. What is nearer is in the first, what is farther in the last.
# Source: modelling choice.
SHELLS, NEAREST, FARTHEST = 11, 1.0, 60.0
_ALL_EDGES = np.geomspace(NEAREST, FARTHEST, SHELLS + 1)
SHELL_EDGES = _ALL_EDGES[1:-1]
SHELL_MIDDLES = np.sqrt(_ALL_EDGES[1:] * _ALL_EDGES[:-1])


@dataclass(frozen=True, eq=False)
class IsolatedPoints(ViewedPoints):
    """One or more scans as a network sees them that judges isolated points alone.

    The M points are the distinct returns of the scan, along a Morton curve: of several rows at one
    position, or of one return that is written more than once, the network sees the first, and all
    are given its score. Of those, S are isolated; the others are no rain.

    Attributes:
        points: x, y, z in metres, in the sensor's frame, float32 (M, 3).
        cell: Shell and rank of intensity of each point, ``shell * INTENSITY_RANKS + rank``, int64
            (M,).
        neighbours: Of each isolated point itself, then its nearest neighbours in ascending
            distance, as rows of ``points``, int64 (S, k).
        distances: Their distances in metres, float32 (S, k).
        step: The angle between neighbouring beams of each scan, radians, float32 (B,).
        counts: Points of each scan by shell and rank of intensity, float32 (B, SHELLS,
            INTENSITY_RANKS).
        first: Row of the scan that each point was taken from, int64 (M,).
        inverse: Point of each row of the scan, int64 (N,); -1 for rows at no point.
    """

    cell: Ints
    step: Float32s
    counts: Float32s

    @property
    def varying(self) -> Mapping[str, str]:
        """The inputs that are longer in some scans than in others, and what is on them."""
        of_points, of_isolated = ("points", "cell"), ("distances", "neighbours")
        return dict.fromkeys(of_points, "points") | dict.fromkeys(of_isolated, "isolated")

    @property
    def size(self) -> int:
        """S, the number of isolated points."""
        return len(self.neighbours)

    def inputs(self) -> dict[str, Array]:
        """The network's inputs, in its order."""
        return {name: getattr(self, name) for name in (*self.varying, "step", "counts")}


@VIEWS.add("isolated_points")
@dataclass(frozen=True)
class IsolatedPointView(View):
    """Converts a scan into its isolated points; the same in training and in deployment.

    Args:
        neighbours: k, the size of a neighbourhood, the point itself included.
        threads: Threads of the search; 0 takes every core this process may use.
    """

    WEIGHS_INTENSITY: ClassVar[bool] = True

    neighbours: int = 9
    threads: int = 0

    @classmethod
    def of(cls, entry: Entry, channels: Channels, fill_value: FillValues, threads: int) -> Self:
        """The view that a Spec describes by its ``kind`` and its ``neighbours``.

        Raises:
            InputError: Something that does not describe it.
        """
        neighbours = neighbours_at(entry)
        if channels != CHANNELS:
            raise entry.fault(f"its channels are not {', '.join(CHANNELS)}", "Export it again.")
        return cls(neighbours, threads)

    def as_dict(self) -> dict[str, Any]:
        """Its part of a Spec: ``kind`` and ``neighbours``."""
        return {"kind": self.NAME, "neighbours": self.neighbours}

    def __call__(self, scan: Scan) -> IsolatedPoints:
        """Views a scan."""
        first, inverse, xyz, search, step = self._returns(scan)
        isolated = np.flatnonzero(crowding(xyz, step) <= MOST_CROWDED)
        neighbours, distances = search(self.neighbours, isolated)
        cell = _cells(xyz, intensity_rank(scan)[first])
        counts = np.bincount(cell, minlength=SHELLS * INTENSITY_RANKS).astype(np.float32)
        counts = counts.reshape(1, SHELLS, INTENSITY_RANKS)
        steps = np.array([step], np.float32)
        return IsolatedPoints(xyz, neighbours, distances, first, inverse, cell, steps, counts)

    def _returns(self, scan: Scan) -> tuple[Ints, Ints, Float32s, NeighbourSearch, float]:
        """The distinct returns of a scan, and the step between its beams.

        Returns:
            ``first``, ``inverse`` and ``points`` as of :class:`IsolatedPoints`; what finds
            neighbours among these; and radians.
        """
        first, inverse = distinct_rows(scan)
        # take is four times faster than indexing for rows of three numbers.
        xyz = scan.xyz.take(first, axis=0)
        search, step, doubled = self._searched(xyz, first)
        if doubled:
            kept, point = merged_points(xyz, first, *search(1 + STEP_NEIGHBOURS))
            first, inverse = first[kept], np.append(point, -1)[inverse]
            xyz = xyz.take(kept, axis=0)
            search, step, _ = self._searched(xyz, first)
        return first, inverse, xyz, search, step

    def _searched(self, xyz: Float32s, first: Ints) -> tuple[NeighbourSearch, float, bool]:
        """The neighbour search, the step, and whether some returns are written more than once.

        The latter two are those of a sample: where none of thousands is written twice, the few that
        may be make no difference.
        """
        search = NeighbourSearch(xyz, rank=first, threads=self.threads)
        some = np.unique(np.arange(SAMPLED) * len(first) // SAMPLED)[: len(first)]
        neighbours, distances = search(1 + STEP_NEIGHBOURS, some)
        doubled = are_one_return(xyz, some, neighbours, distances).any()
        return search, beam_step(xyz, some, neighbours), bool(doubled)


def _cells(xyz: Float32s, rank: Ints) -> Ints:
    """Shell and rank of each point together, int64 (M,).

    Args:
        xyz: Positions in the sensor's frame, float32 (M, 3), metres.
        rank: Ranks of their intensities, int64 (M,).
    """
    x, y, z = np.ascontiguousarray(xyz.T)
    squared = x * x + y * y + z * z
    shell = edges_reached(squared, np.square(SHELL_EDGES).astype(np.float32))
    return shell * INTENSITY_RANKS + rank


def beam_step(xyz: Float32s, rows: Ints, neighbours: Ints) -> float:
    """The angle between neighbouring beams, by what lies near some points.

    Args:
        xyz: Positions in the sensor's frame, float32 (M, 3), metres.
        rows: Some of the points, int64 (Q,).
        neighbours: Each of these and its nearest neighbours, rows of ``xyz``, int64
            (Q, 1 + STEP_NEIGHBOURS).

    Returns:
        Radians.
    """
    if len(xyz) <= STEP_NEIGHBOURS:
        return USUAL_STEP
    own = _directions(xyz.take(rows, axis=0))
    chords = np.zeros(len(rows))
    for column in neighbours[:, 1:].T:
        other = _directions(xyz.take(column, axis=0))
        chords = np.maximum(chords, np.square(other - own).sum(axis=0))
    return max(float(np.sqrt(np.median(chords))), FINEST_STEP)


def _directions(xyz: Float32s) -> Floats:
    """Unit vectors to some points, float64 (3, Q)."""
    axes = np.array(xyz.T, np.float64, order="C")
    length = np.maximum(np.sqrt(np.square(axes).sum(axis=0)), NEAREST_POINT)
    return np.asarray(axes / length)


def crowding(xyz: Float32s, step: float) -> Float32s:
    """How crowded each point is, together with the least crowded point near it.

    A point is as crowded as there are others near it, weighted less the farther they are. Rain is
    among rain, so one of its neighbours is alone even where drops are dense; on a surface none is.

    Only what lies near a point along the curve counts, so that nothing is searched for: a crowded
    point is crowded for sure, and one that seems to be alone may not be.

    Args:
        xyz: Positions in the sensor's frame along a Morton curve, float32 (M, 3), metres.
        step: Angle between neighbouring beams, radians.

    Returns:
        From 0 to four times WINDOW, float32 (M,).
    """
    x, y, z = np.ascontiguousarray(xyz.T)
    squared = np.maximum(x * x + y * y + z * z, np.float32(NEAREST_POINT**2))
    per_half = 1 / (squared * np.float32((HALF_AT * step) ** 2))
    near = np.zeros(len(xyz), np.float32)
    pairs = [(slice(None, -n), slice(n, None)) for n in range(1, min(WINDOW, len(xyz) - 1) + 1)]
    for before, after in pairs:
        distance = np.square(x[after] - x[before])
        distance += np.square(y[after] - y[before])
        distance += np.square(z[after] - z[before])
        for side in (before, after):
            near[side] += 1 / (1 + distance * per_half[side])
    least = near.copy()
    for before, after in pairs:
        np.minimum(least[before], near[after], out=least[before])
        np.minimum(least[after], near[before], out=least[after])
    return near + least
