"""ROR and DROR, by which a point is rain if it has few points around it.

They need no search for most points. Points that are next to each other along a Morton curve are
near in space, and most points of a scan have enough others within their radius among the next few
along the curve: only the remaining ones are searched for.
"""

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from derain.filters.point_filter import FILTERS, TUNED_NEIGHBOURS, PointFilter, RainAndPoints
from derain.scan import Bools, Float32s, Floats, Ints, Scan
from derain.system.stopwatch import Stopwatch
from derain.views.candidates import Candidates
from derain.views.morton import distinct_rows
from derain.views.neighbour_search import NeighbourSearch
from derain.views.neighbours import Neighbourhoods

# Places along the curve that are looked at to either side of a point. Four settle 86 of 100 points
# of the WADS sample with DROR; eight settle one more, for twice the time.
CURVE_STEPS = 4

# Closer to the radius than this share of it, the search decides, so that rounding never does.
MARGIN = 1e-6


@dataclass(frozen=True)
class RadiusFilter(PointFilter):
    """Calls a point rain where fewer than ``neighbours`` points lie within a radius of it.

    The point itself counts as one, and one at exactly the radius is within.
    """

    @abstractmethod
    def radius_at(self, points: Float32s) -> Floats:
        """The radius around each point.

        Args:
            points: x, y, z in metres, then whatever else is known of them, float32 (M, ≥ 3).

        Returns:
            Metres, float64 (M,).
        """

    def judge(self, view: Neighbourhoods) -> Bools:
        """Returns which points are rain; see :class:`PointFilter`.

        No radius is searched: at least k points lie within it exactly where the k-th nearest is
        no farther than it.
        """
        if view.size < self.neighbours:
            return np.ones(view.size, bool)  # the view's k-th nearest is then a stand-in
        last = view.distances[:, self.neighbours - 1]
        return last > self.radius_at(view.points)

    def judge_scan(
        self, scan: Scan, threads: int, candidates: Candidates | None, stopwatch: Stopwatch
    ) -> RainAndPoints:
        """Finds the rain of a scan; see :class:`PointFilter`."""
        with stopwatch.stage("view"):
            first, inverse = distinct_rows(scan)
            xyz = scan.xyz.take(first, axis=0)
        with stopwatch.stage("network"):
            among = None if candidates is None else candidates.among(scan)[first]
            few = has_few_neighbours(xyz, self.radius_at(xyz), self.neighbours, threads, among)
        return few, inverse


@FILTERS.add("ror")
@dataclass(frozen=True)
class ROR(RadiusFilter):
    """Calls a point rain if it has few points around it.

    Rain where fewer than ``neighbours`` points, itself included, lie within ``radius``. PCL's
    RadiusOutlierRemoval and Open3D's remove_radius_outlier decide alike, but count the point
    itself on neither side: their number is one less than ``neighbours``.

    Example:
        >>> scan = derain.read_scan("scan.bin")  # a wall of 800 points and 20 drops before it
        >>> rain = derain.FilterDerainer(ROR())(scan)
        >>> int(rain.sum()), bool((scan.range[rain] < 15).all())
        (20, True)

    Attributes:
        neighbours: Points to be found, the point itself included.
        radius: Radius of the sphere, metres; a point on it is within.

    Source: R. B. Rusu and S. Cousins, "3D is here: Point Cloud Library", ICRA 2011. The defaults
        are those of github.com/nickcharron/lidar_snow_removal (3 others, 0.08 m).
    """

    HELP = "rain has few points within a radius"
    SPACE: ClassVar = {"neighbours": TUNED_NEIGHBOURS, "radius": (0.01, 3.0)}

    neighbours: int = 4
    radius: float = 0.08

    def radius_at(self, points: Float32s) -> Floats:
        """The radius around each point; see :class:`RadiusFilter`."""
        return np.full(len(points), self.radius, np.float64)


@FILTERS.add("dror")
@dataclass(frozen=True)
class DROR(RadiusFilter):
    """Calls a point rain if it has few points around it for the spacing of beams at its range.

    Rain where fewer than ``neighbours`` points, itself included, lie within a radius that grows
    with the point's horizontal range ρ = √(x² + y²), and is ``minimum_radius`` at least:

    - variant ``code``, what the authors' program computes:
      ``radius_multiplier`` · 2 · ρ · sin(``azimuth_resolution``);
    - variant ``paper``, what their paper states:
      ``radius_multiplier`` · ρ · ``azimuth_resolution`` in radians.

    The resolution is 0.16° by default, as in the authors' launch file. The 0.04° of their class is
    finer than what spinning sensors step by: on the WADS sample it takes 40 % of the points that
    are no snow for snow, 0.16° takes 2 %.

    Example:
        >>> scan = derain.read_scan("scan.bin")  # a wall of 800 points and 20 drops before it
        >>> rain = derain.FilterDerainer(DROR())(scan)
        >>> int(rain.sum()), bool((scan.range[rain] < 15).all())
        (20, True)

    Attributes:
        neighbours: Points to be found, the point itself included.
        radius_multiplier: Beam spacings that make a radius.
        azimuth_resolution: Angle between neighbouring beams, degrees.
        minimum_radius: Smallest radius, metres.
        variant: ``code`` or ``paper``.

    Raises:
        InputError: Another variant, and as of :class:`derain.filters.PointFilter`.

    Source: N. Charron, S. Phillips and S. L. Waslander, "De-noising of Lidar Point Clouds Corrupted
        by Snowfall", CRV 2018, and github.com/nickcharron/lidar_snow_removal.
    """

    HELP = "rain has few points within a radius that grows with range"
    # Of multiplier and resolution only the product counts: one of them is looked for.
    SPACE: ClassVar = {
        "neighbours": TUNED_NEIGHBOURS,
        "radius_multiplier": (0.3, 30.0),
        "minimum_radius": (0.005, 1.0),
    }

    neighbours: int = 3
    radius_multiplier: float = 3.0
    azimuth_resolution: float = 0.16
    minimum_radius: float = 0.04
    variant: Literal["code", "paper"] = "code"

    def radius_at(self, points: Float32s) -> Floats:
        """The radius around each point; see :class:`RadiusFilter`."""
        x, y = points[:, :2].T.astype(np.float64)
        angle = math.radians(self.azimuth_resolution)
        spacing = 2 * math.sin(angle) if self.variant == "code" else angle
        radius: Floats = self.radius_multiplier * spacing * np.sqrt(x * x + y * y)
        return np.maximum(radius, self.minimum_radius)


def has_few_neighbours(
    xyz: Float32s, radius: Floats, count: int, threads: int, queried: Bools | None = None
) -> Bools:
    """Finds the points that have fewer than ``count`` points within their radius.

    Args:
        xyz: Distinct positions along a Morton curve, float32 (M, 3), metres.
        radius: Metres, float64 (M,); a point at exactly this distance is within.
        count: Number of points, the point itself included.
        threads: Threads of the search.
        queried: Points to judge, bool (M,); None for all.

    Returns:
        bool (M,), False for points that are not queried; the same in whatever order the points
        are, but sooner along a curve.
    """
    few = np.ones(len(xyz), bool) if queried is None else queried.copy()
    if len(xyz) < count or not few.any():
        return few
    places = xyz.astype(np.float64)
    few[_found_along_curve(places, radius * (1 - MARGIN)) >= count] = False
    unsettled = np.flatnonzero(few)
    if not len(unsettled):
        return few
    _, squared = NeighbourSearch(xyz, threads=threads).nearest(unsettled, count)
    # Rounded to float32 as the distances of the neighbour view are, so that a filter decides alike
    # whether it judges alone or shares a view with others.
    distance = np.sqrt(squared[:, count - 1].astype(np.float32))
    few[unsettled] = distance > radius[unsettled]
    return few


def _found_along_curve(places: Floats, radius: Floats) -> Ints:
    """Counts points within the radius: the point itself and CURVE_STEPS places to either side.

    Args:
        places: Positions in the order of the curve, float64 (M, 3), metres.
        radius: That of each point, metres, float64 (M,).

    Returns:
        At most as many as there are within the radius, int64 (M,).
    """
    columns, limit = np.ascontiguousarray(places.T), np.square(radius)
    found = np.ones(len(places), np.int64)
    # Every step writes into the same array, which is faster than to make one for each.
    room = np.empty_like(columns)
    for step in range(1, min(CURVE_STEPS, len(places) - 1) + 1):
        apart = np.subtract(columns[:, step:], columns[:, :-step], out=room[:, step:])
        squared = np.square(apart, out=apart).sum(axis=0)
        found[step:] += squared <= limit[step:]
        found[:-step] += squared <= limit[:-step]
    return found
