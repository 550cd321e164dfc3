"""The filter of conditional random fields."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import ClassVar, Literal

import numpy as np

from derain.filters.airborne import Around, fit_rain_bounds
from derain.filters.ground import find_ground
from derain.filters.point_filter import FILTERS, PointFilter, RainAndPoints, filter_view
from derain.filters.random_field import decide_sequentially
from derain.scan import Bools, Float32s, Floats, Ints, Scan
from derain.system.stopwatch import Stopwatch
from derain.views.candidates import Candidates
from derain.views.channels import filled_values
from derain.views.morton import distinct_rows
from derain.views.neighbour_search import NeighbourSearch
from derain.views.neighbours import Neighbourhoods
from derain.views.scan_issues import ScanIssue, intensity_of_another_scale, missing_intensity
from derain.views.scatter import scatter_through_space

# Added to every range, metres, so that none is 0.
# Source: CRFOR.
BESIDE_RANGE = 0.1

# Of points of any intensity up to 2 the feature is at least 5 / 3, and at most 4 / 3 · (5 + 1)
# where neighbours are no farther, on average, than the sensor. Fitted, it is scaled by these.
LEAST_FEATURE, LARGEST_FEATURE = 5 / 3, 8.0


@FILTERS.add("crf")
@dataclass(frozen=True)
class CRF(PointFilter):
    """Classifies each point by its neighbourhood, and by the classes of the points around it.

    Only candidates may be rain: near, above the ground, and as bright as rain is. Of each of them

        F = (1 + s) · (5 + mean(d) / (range + 0.1 m)) / (1 + intensity)

    over its neighbourhood, itself included; d are the distances, and s is 0 where the points lie in
    a plane and 1/3 where they are scattered alike in all directions
    (:func:`derain.views.scatter.scatter_through_space`). F is scaled to -1..1; above 0.6 the
    point is rain, up to -0.4 it is not, and between them
    :func:`derain.filters.random_field.decide_sequentially` decides, in the order of azimuth from
    behind the sensor once around it. That is the order of files which a spinning sensor wrote, by
    which the authors' program goes; but it does not depend on the file, save that of equally near
    neighbours the one of the lower row comes first.

    Variant ``published`` has its authors' bounds, which are for one sensor on one car and its unit
    of intensity: ``intensity``, ``range`` and ``sensor_height`` above the ground. It scales F from
    its least to its largest value in the scan.

    Variant ``fitted`` takes all bounds from the scan itself, whatever the unit or the mounting, and
    whether rain is darker or brighter than the rest: what is above the plane of the road
    (:func:`derain.filters.ground.find_ground`), and within the intensities and ranges of what is in
    the air (:func:`derain.filters.airborne.fit_rain_bounds`). Within these bounds intensity shows
    nothing more: F is that of intensity 0, and is scaled by constants. Where it does not rain,
    there are no such bounds, and nothing is called rain.

    Without intensity, nothing is found.

    Example:
        >>> scan = derain.read_scan("scan.bin")  # a wall of 800 points and 20 drops before it
        >>> rain = derain.FilterDerainer(CRF())(scan)
        >>> int(rain.sum()), bool((scan.range[rain] < 15).all())
        (20, True)

    Attributes:
        neighbours: Size of a neighbourhood, the point itself included, at least 4.
        variant: ``fitted`` or ``published``.
        vote: Weight of a neighbour that is judged, beside features from -1 to 1.
        sparseness: Of variant ``fitted``: how many times as far as usual, for its range, the
            neighbours of a point are that is in the air.
        reach: Of variant ``fitted``: how many times as far as 95 % of what is in the air rain may
            be.
        intensity: Of variant ``published``: of rain it is at most this.
        range: Of variant ``published``: rain is no farther, metres.
        sensor_height: Of variant ``published``: rain is no deeper below the sensor, metres.
        FULL_SCALE: Of the intensities that variant ``published`` is for.

    Raises:
        InputError: Another variant, and as of :class:`derain.filters.PointFilter`.

    Source: W. Wang et al., "Snow Removal for LiDAR Point Clouds With Spatio-Temporal Conditional
        Random Fields", RA-L 2023, and its constants at github.com/dut-mdmu/CRFOR. The order
        by azimuth and the fitted bounds are derain's own.
    """

    HELP = "rain is near, above the ground, as bright as drops are, and beside rain"
    SPACE: ClassVar = {
        "neighbours": (4, 12),
        "vote": (0.1, 20.0),
        "sparseness": (1.5, 10.0),
        "reach": (0.5, 5.0),
    }
    FULL_SCALE = 255.0
    # Fewer points are always in a plane, and nothing would ever be seen to be in the air.
    FEWEST_NEIGHBOURS = 4

    neighbours: int = 8
    variant: Literal["fitted", "published"] = "fitted"
    vote: float = 2.0
    sparseness: float = 3.0
    reach: float = 2.0
    intensity: float = 2.0
    range: float = 30.0
    sensor_height: float = 1.8

    def judge(self, view: Neighbourhoods) -> Bools:
        """Returns which points are rain; see :class:`PointFilter`."""
        size = min(self.neighbours, view.size)  # where there are fewer, the rest are stand-ins
        neighbours, distances = view.neighbours[:, :size], view.distances[:, :size]
        return self._rain(
            view.points, lambda rows: (neighbours.take(rows, axis=0), distances.take(rows, axis=0))
        )

    def judge_scan(
        self, scan: Scan, threads: int, candidates: Candidates | None, stopwatch: Stopwatch
    ) -> RainAndPoints:
        """Finds the rain, with neighbours of candidates alone; see :class:`PointFilter`."""
        with stopwatch.stage("view"):
            first, inverse = distinct_rows(scan)
            view = filter_view(self.neighbours, threads)
            points = filled_values(scan, first, view.channels, view.fill_value)
            search = NeighbourSearch(points[:, :3], rank=first, threads=threads)
        with stopwatch.stage("network"):
            rain = self._rain(points, partial(search, min(self.neighbours, len(points))))
            if candidates is not None:
                rain &= candidates.among(scan)[first]
        return rain, inverse

    def issues(self, scan: Scan) -> Iterator[ScanIssue]:
        """Warnings about a scan: no intensity, or another unit than the published bound's."""
        yield from missing_intensity(scan)
        if self.variant == "published":
            yield from intensity_of_another_scale(scan, self.FULL_SCALE, self.name)

    def _rain(self, points: Float32s, around: Around) -> Bools:
        """True for points that are rain, bool (M,).

        Args:
            points: Distinct x, y and z in metres along a Morton curve, and intensity,
                float32 (M, 4).
            around: Finds neighbourhoods of as many points as the filter looks at, or as there are.
        """
        xyz, intensity = points[:, :3].astype(np.float64), points[:, 3]
        distance = np.sqrt(np.square(xyz).sum(axis=1))
        rows = np.flatnonzero(self._is_candidate(xyz, intensity, distance, around))
        if not len(rows):
            return np.zeros(len(points), bool)
        neighbours, distances = around(rows)
        mean = distances.T.astype(np.float64).mean(axis=0)
        spacing = mean / (distance[rows] + BESIDE_RANGE)
        scatter = scatter_through_space(xyz, neighbours)
        feature = np.full(len(points), -1.0)
        feature[rows] = self._feature(scatter, spacing, intensity[rows].astype(np.float64))
        place = _along_the_sweep(xyz.take(rows, axis=0))
        return decide_sequentially(feature, rows, place, neighbours, distances, self.vote)

    def _is_candidate(
        self, xyz: Floats, intensity: Float32s, distance: Floats, around: Around
    ) -> Bools:
        """True for points that may be rain, bool (M,)."""
        if self.variant == "published":
            is_near = (distance <= self.range) & (xyz[:, 2] >= -self.sensor_height)
            return is_near & (intensity <= self.intensity)
        ground = find_ground(xyz)
        above = np.ones(len(xyz), bool) if ground is None else ground.is_above(xyz)
        bounds = fit_rain_bounds(
            xyz, distance, intensity, above, around, self.sparseness, self.reach
        )
        if bounds is None:
            return np.zeros(len(xyz), bool)
        return above & bounds.hold(intensity, distance)

    def _feature(self, scatter: Floats, spacing: Floats, intensity: Floats) -> Floats:
        """F of each candidate, scaled to -1..1, float64 (Q,)."""
        if self.variant == "fitted":
            feature = (1 + scatter) * (5 + np.minimum(spacing, 1))
            least, largest = LEAST_FEATURE, LARGEST_FEATURE
        else:
            feature = (1 + scatter) * (5 + spacing) / (1 + np.maximum(intensity, 0))
            least, largest = float(feature.min()), float(feature.max())
        if largest == least:  # nothing stands out
            return np.full(len(feature), -1.0)
        return np.asarray(2 * (feature - least) / (largest - least) - 1)


def _along_the_sweep(xyz: Floats) -> Ints:
    """Place of each point in the order of azimuth; along the curve where that is equal.

    Args:
        xyz: Distinct positions along a Morton curve, float64 (Q, 3), metres.

    Returns:
        int64 (Q,).
    """
    x, y, _ = xyz.T
    # What is just behind may have a y of -0.0, which is 0.0 then.
    order = np.argsort(np.arctan2(y + 0.0, x), kind="stable")
    place = np.empty(len(order), np.int64)
    place[order] = np.arange(len(order))
    return place
