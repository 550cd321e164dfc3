"""The neighbour view: every point of a scan with its nearest neighbours."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Self

import numpy as np

from derain.files.documents import Entry
from derain.scan import Array, Bools, Float32s, Ints, Scan
from derain.views.candidates import Candidates
from derain.views.channels import Channels, FillValues, filled_values
from derain.views.morton import distinct_rows
from derain.views.neighbour_search import NeighbourSearch
from derain.views.view import VIEWS, BackProjection, View, ViewedScan

# The most neighbours that a Spec may state, seven times as many as those of 3D-OutDet. A
# hundred thousand points have 80 MB of them.
MOST_NETWORK_NEIGHBOURS = 64


@dataclass(frozen=True, eq=False)
class ViewedPoints(ViewedScan):
    """One or more scans as a network sees them that judges some or all of their points.

    Attributes:
        points: Channels of M points, float32 (M, C).
        neighbours: Of F points the point itself, then its nearest neighbours in ascending
            distance, as rows of ``points``, int64 (F, k). Those that are scored come first.
        distances: Their distances in metres, float32 (F, k).
        first: Row of the scan that each point was taken from, int64 (M,).
        inverse: Point of each row of the scan, int64 (N,); -1 for rows at no point.
    """

    points: Float32s
    neighbours: Ints
    distances: Float32s
    first: Ints
    inverse: Ints

    @property
    def judged(self) -> Bools:
        """True for rows of the scan at some point, bool (N,); not rain where it is not scored."""
        return self.inverse >= 0

    def target(self, rain: Bools) -> Ints:
        """Training target of each point that is scored.

        Args:
            rain: Truth for every row of the scan, bool (N,).

        Returns:
            1 for rain, 0 for everything else, int64 (J,).
        """
        return rain[self.first[self._scored]].astype(np.int64)

    def back_projection(self) -> BackProjection:
        """Back-projection: gives every row the score of its point, and 0 if that has none."""
        return partial(_to_rows, self.inverse, self._scored, len(self.points))

    @staticmethod
    def pack(seen: Sequence[ViewedScan]) -> dict[str, Array]:
        """Inputs of several scans as one cloud, each scan's neighbours staying its own."""
        inputs = [one.inputs() for one in seen]
        # What an input counts by its numbers: rows of another input, scan after scan.
        for name, of in (("neighbours", "points"), ("candidates", "neighbours")):
            if name in inputs[0]:
                before = np.cumsum([0, *(len(one[of]) for one in inputs)])
                for one, rows in zip(inputs, before, strict=False):
                    one[name] = one[name] + rows
        return {name: np.concatenate([one[name] for one in inputs]) for name in inputs[0]}

    @property
    def _scored(self) -> Ints:
        """Each point that is scored as a row of ``points``, int64 (J,)."""
        if self.size == len(self.points):
            return np.arange(self.size)  # faster than to read them, each far from the next
        # A copy, so that a back-projection does not keep all neighbours in memory.
        return self.neighbours[: self.size, 0].copy()


@dataclass(frozen=True, eq=False)
class Neighbourhoods(ViewedPoints):
    """One or more scans as a point network sees them.

    The M points are the distinct positions of the scan, along a Morton curve. Of several rows
    at one position the network sees the first, and all of them are given its score.

    Without candidates, each point has its neighbourhood and is scored: F = J = M. With them, J of
    the points are scored. A network that looks at neighbours of neighbours, as 3D-OutDet does,
    needs the neighbourhoods of F of them: of candidates, and of all that are neighbours of one.

    Attributes:
        points: The view's channels, each in its own unit, float32 (M, C).
        neighbours: Of F points the point itself, then its nearest neighbours in ascending
            distance, as rows of ``points``, int64 (F, k).
        distances: Their distances in metres, float32 (F, k).
        first: Row of the scan that each point was taken from, int64 (M,).
        inverse: Point whose score each row of the scan is given, int64 (N,); -1 for rows at no
            point.
        candidates: Of each candidate the neighbourhoods of the points in its own, the first being
            its own, as rows of ``neighbours``, int64 (J, k). None where all points are scored.
    """

    candidates: Ints | None = None

    @property
    def varying(self) -> Mapping[str, str]:
        """The inputs, each as long as the scan has points, neighbourhoods or candidates."""
        if self.candidates is None:
            return dict.fromkeys(("points", "distances", "neighbours"), "points")
        return {
            "points": "points",
            "distances": "neighbourhoods",
            "neighbours": "neighbourhoods",
            "candidates": "candidates",
        }

    @property
    def size(self) -> int:
        """J, the number of points that the network scores."""
        return len(self.points if self.candidates is None else self.candidates)

    def inputs(self) -> dict[str, Array]:
        """The network's inputs, in its order: points, distances, neighbours, and any candidates."""
        return {name: getattr(self, name) for name in self.varying}


@VIEWS.add("neighbours")
@dataclass(frozen=True)
class NeighbourView(View):
    """Converts a scan into neighbourhoods; the same in training and in deployment.

    Args:
        neighbours: k, the size of a neighbourhood, the point itself included.
        channels: The network's input channels, in order, as :meth:`Scan.channel` names it.
        fill_value: Replacement of a value that a scan lacks, by channel; 0 if not named.
        threads: Threads of the search; 0 takes every core this process may use.
        candidates: Points that are scored; None for all.
    """

    neighbours: int = 9
    channels: Channels = ("x", "y", "z", "intensity")
    fill_value: FillValues = field(default_factory=dict)
    threads: int = 0
    candidates: Candidates | None = None

    @classmethod
    def of(cls, entry: Entry, channels: Channels, fill_value: FillValues, threads: int) -> Self:
        """The view that a Spec describes by its ``kind`` and its ``neighbours``.

        Raises:
            InputError: Something that does not describe it.
        """
        return cls(neighbours_at(entry), channels, fill_value, threads)

    def as_dict(self) -> dict[str, Any]:
        """Its part of a Spec: ``kind`` and ``neighbours``."""
        return {"kind": self.NAME, "neighbours": self.neighbours}

    def with_candidates(self, candidates: Candidates) -> Self:
        """The same view, that scores candidates alone."""
        return replace(self, candidates=candidates)

    def __call__(self, scan: Scan) -> Neighbourhoods:
        """Views a scan."""
        first, inverse = distinct_rows(scan)
        search = NeighbourSearch(scan.xyz.take(first, axis=0), rank=first, threads=self.threads)
        points = filled_values(scan, first, self.channels, self.fill_value)
        if self.candidates is None:
            neighbours, distances = search(self.neighbours)
            return Neighbourhoods(points, neighbours, distances, first, inverse)
        candidate = self.candidates.among(scan)[first]
        neighbours, distances, candidates = _around(search, candidate, self.neighbours)
        return Neighbourhoods(points, neighbours, distances, first, inverse, candidates)


def neighbours_at(entry: Entry) -> int:
    """Reads the size of a neighbourhood from a Spec of a view, which has its ``kind`` besides.

    Raises:
        InputError: Something that does not describe it.
    """
    parsers = {"kind": Entry.text, "neighbours": lambda e: e.whole(1, MOST_NETWORK_NEIGHBOURS)}
    neighbours: int = entry.record(parsers, required=("neighbours",))["neighbours"]
    return neighbours


def _around(search: NeighbourSearch, candidate: Bools, k: int) -> tuple[Ints, Float32s, Ints]:
    """Neighbourhoods of candidates, and of all points in them.

    Args:
        search: Finds neighbours among M points.
        candidate: True for candidates, bool (M,).
        k: Size of a neighbourhood.

    Returns:
        ``neighbours`` int64 (F, k), ``distances`` float32 (F, k) and ``candidates`` int64 (J, k) of
        :class:`Neighbourhoods`; candidates come first.
    """
    own = np.flatnonzero(candidate)
    of_candidates, their_distances = search(k, own)
    needed = np.zeros(len(candidate), bool)
    needed[of_candidates.ravel()] = True
    others = np.flatnonzero(needed & ~candidate)
    of_others, other_distances = search(k, others)
    place = np.empty(len(candidate), np.int64)
    place[own] = np.arange(len(own))
    place[others] = np.arange(len(own), len(own) + len(others))
    return (
        np.concatenate([of_candidates, of_others]),
        np.concatenate([their_distances, other_distances]),
        place.take(of_candidates),
    )


def _to_rows(inverse: Ints, scored: Ints, points: int, score: Float32s) -> Float32s:
    """Gives each row of a scan the score of its point.

    Args:
        inverse: Point of each row, int64 (N,); -1 for rows at none.
        scored: The points that are scored, int64 (J,).
        points: M, the number of points.
        score: float32 (J,).

    Returns:
        float32 (N,); 0 for rows at no point, or at one that is not scored.
    """
    # The last place is for rows at no point, whose number is -1.
    of_points = np.zeros(points + 1, np.float32)
    of_points[scored] = score
    return of_points.take(inverse)
