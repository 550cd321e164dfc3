"""One search for the neighbours in a scan, for all the filters of a bench."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from derain.evaluation.scores import ScoredMethod
from derain.export.bench.contestant import Contestant, TimedMethod
from derain.filters import PointFilter
from derain.filters.filter_view import filter_view, rain_among
from derain.scan import Scan
from derain.system.stopwatch import Stopwatch
from derain.views.candidates import Candidates


def scored_methods(contestants: Sequence[Contestant], threads: int) -> list[ScoredMethod]:
    """The methods, ready to judge one scan after the other; filters share what they see of it.

    Args:
        contestants: The methods.
        threads: Threads of views and networks; 0 takes every core this process may use.
    """
    shared = SharedSearch([row.filter for row in contestants if row.filter], threads)
    return [
        partial(shared.judge, row.filter, row.candidates)
        if row.filter
        else partial(_untimed, row.ready(threads))
        for row in contestants
    ]


class SharedSearch:
    """Sees each scan once, with as many neighbours as the most demanding of some filters asks for.

    Args:
        filters: The filters.
        threads: Threads of the search; 0 takes every core this process may use.
    """

    def __init__(self, filters: Sequence[PointFilter], threads: int) -> None:
        most = max((filter.neighbours for filter in filters), default=0)
        self._view = filter_view(most, threads)
        self._scan: Scan | None = None

    def judge(
        self, filter: PointFilter, candidates: Candidates | None, scan: Scan
    ) -> NDArray[np.bool_]:
        """Which points one of the filters calls rain among candidates, bool (N,)."""
        if scan is not self._scan:
            self._scan, self._seen = scan, self._view(scan)
        rain = rain_among(filter, self._seen, scan, candidates)
        return self._seen.back(rain.astype(np.float32)) > 0


def _untimed(method: TimedMethod, scan: Scan) -> NDArray[np.bool_]:
    return method(scan, Stopwatch())
