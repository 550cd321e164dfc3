"""What filters by radius share: a point is rain if it has few points around it."""

from abc import abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from derain.filters.filter_view import rows_of
from derain.filters.neighbour_counts import has_few_neighbours
from derain.filters.point_filter import PointFilter, RainAndJudged
from derain.scan import Scan
from derain.system.stopwatch import Stopwatch
from derain.views.candidates import Candidates
from derain.views.morton import distinct_rows
from derain.views.neighbours import Neighbourhoods


@dataclass(frozen=True)
class RadiusFilter(PointFilter):
    """Calls a point rain where fewer than ``neighbours`` points lie within a radius of it.

    The point itself counts as one, and one at exactly the radius is within.
    """

    @abstractmethod
    def radius_at(self, points: NDArray[np.float32]) -> NDArray[np.float64]:
        """The radius around each point.

        Args:
            points: x, y, z in metres, then whatever else is known of them, float32 (M, ≥ 3).

        Returns:
            Metres, float64 (M,).
        """

    def judge(self, view: Neighbourhoods) -> NDArray[np.bool_]:
        """Says which points are rain; see :class:`PointFilter`.

        No radius is searched: at least k points lie within it exactly where the k-th nearest is
        no farther than it.
        """
        if view.size < self.neighbours:
            return np.ones(view.size, bool)  # the view's k-th nearest is then a stand-in
        last = view.distances[:, self.neighbours - 1]
        lonely: NDArray[np.bool_] = last > self.radius_at(view.points)
        return lonely

    def judge_scan(
        self, scan: Scan, threads: int, candidates: Candidates | None, stopwatch: Stopwatch
    ) -> RainAndJudged:
        """Says which rows of a scan are rain; see :class:`PointFilter`."""
        with stopwatch.stage("view"):
            first, inverse = distinct_rows(scan)
            xyz = scan.xyz.take(first, axis=0)
        with stopwatch.stage("network"):
            among = None if candidates is None else candidates.among(scan)[first]
            few = self.judge_without_neighbours(xyz, threads, among)
        with stopwatch.stage("back"):
            return rows_of(few, inverse), inverse >= 0

    def judge_without_neighbours(
        self, xyz: NDArray[np.float32], threads: int, candidate: NDArray[np.bool_] | None = None
    ) -> NDArray[np.bool_]:
        """Says the same without the neighbours of every point, which is faster.

        Args:
            xyz: Distinct positions along a Morton curve, float32 (M, 3), metres.
            threads: Threads to use.
            candidate: Which points may be rain, bool (M,); None for all.

        Returns:
            True for rain, bool (M,).
        """
        return has_few_neighbours(xyz, self.radius_at(xyz), self.neighbours, threads, candidate)
