"""A filter, ready to judge scans as an exported model does."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from derain.errors import InputError
from derain.filters.point_filter import PointFilter, rows_of
from derain.scan import Array, Bools, Scan
from derain.sources.judgement import Judgement
from derain.sources.method import ScanMethod
from derain.system.cores import threads_of
from derain.system.stopwatch import Stopwatch
from derain.views.candidates import Candidates
from derain.views.one_viewpoint import viewpoint_issues
from derain.views.scan_issues import ScanIssue, intensity_in_places

# What bounds are called among the parameters of a filter; they are the same for every one.
CANDIDATES = "candidates"


class FilterDerainer(ScanMethod):
    """A filter, called as :class:`derain.export.runtime.Derainer` is.

    Example:
        >>> points = np.fromfile("scan.bin", np.float32).reshape(-1, 4)  # x, y, z, intensity
        >>> derainer = FilterDerainer(derain.DROR())
        >>> clean = points[~derainer(points)]
        >>> len(points), len(clean)
        (820, 800)

    Args:
        filter: The filter.
        threads: Threads of the view; 0 takes every core this process may use.
        candidates: Bounds outside which nothing is rain; None where anything may be.

    Raises:
        InputError: Something else than a filter, or threads that are no number from 0 on.
    """

    def __init__(
        self, filter: PointFilter, threads: int = 0, candidates: Candidates | None = None
    ) -> None:
        if not isinstance(filter, PointFilter):
            raise InputError(
                "filter", f"{filter!r} is no filter", "Give one, such as derain.DROR()."
            )
        self.filter = filter
        self.threads = threads_of(threads)
        self.candidates = candidates

    def __call__(self, points: Scan | Array, stopwatch: Stopwatch | None = None) -> Bools:
        """Returns which points are rain.

        Args:
            points: A Scan, or (N, ≥ 3) numbers: x, y, z in metres, then intensity.
            stopwatch: Takes the times of the stages view, network (the filter, so that tables of
                both line up) and back.

        Returns:
            True for rain, bool (N,), in input order; False for rows that cannot be judged.
        """
        return self.judge(points, stopwatch).rain

    def judge(self, points: Scan | Array, stopwatch: Stopwatch | None = None) -> Judgement:
        """Judges a scan.

        Args:
            points: As for calling the filter.
            stopwatch: Takes the times of the stages view, network and back.
        """
        scan, stopwatch = Scan.of(points), stopwatch or Stopwatch()
        of_points, point = self.filter.judge_scan(scan, self.threads, self.candidates, stopwatch)
        with stopwatch.stage("back"):
            rain, judged = rows_of(of_points, point), point >= 0
        return self.with_warnings(Judgement(rain.astype(np.float32), rain, judged, scan))

    @property
    def gives_probabilities(self) -> bool:
        """No: a filter returns which points are rain, and no more."""
        return False

    def issues(self, judgement: Judgement) -> Iterator[ScanIssue]:
        """Warnings about a scan for the filter, or for any method that uses places."""
        yield from viewpoint_issues(judgement.scan)
        yield from intensity_in_places(judgement.scan, judgement.judged)
        yield from self.filter.issues(judgement.scan)

    def as_dict(self) -> dict[str, Any]:
        """The filter's name and parameters, and its candidates if it has any."""
        content: dict[str, Any] = {"method": self.filter.name, **self.filter.as_dict()}
        if self.candidates is not None:
            content[CANDIDATES] = self.candidates.as_dict()
        return content
