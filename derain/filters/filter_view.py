"""What filters see of a scan, and how their verdicts come back to its rows."""

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from derain.scan import Scan
from derain.views.candidates import Candidates
from derain.views.neighbours import Neighbourhoods, NeighbourView

if TYPE_CHECKING:
    from derain.filters.point_filter import PointFilter


def filter_view(neighbours: int, threads: int = 0) -> NeighbourView:
    """How filters see a scan.

    One view serves several filters: each looks at no more than its own number of neighbours.

    Args:
        neighbours: Size of a neighbourhood, the point itself included; the largest that any of the
            filters looks at.
        threads: Threads of the search; 0 takes every core this process may use.
    """
    # In a scan without intensity every point has NaN for it, and no comparison with NaN is true: a
    # filter that judges by intensity finds nothing there.
    return NeighbourView(neighbours, fill_value={"intensity": math.nan}, threads=threads)


def rain_among(
    filter: "PointFilter", view: Neighbourhoods, scan: Scan, candidates: Candidates | None
) -> NDArray[np.bool_]:
    """What a filter calls rain among candidates.

    A filter looks at all points to say what is usual, whether or not they are candidates. So what
    it says of a candidate is what it says without bounds.

    Args:
        filter: The filter.
        view: What it sees of the scan, M points.
        scan: The scan.
        candidates: Bounds outside which nothing is rain; None where anything may be.

    Returns:
        True for rain, bool (M,).
    """
    rain = filter.judge(view)
    return rain if candidates is None else rain & candidates.among(scan)[view.first]


def rows_of(points: NDArray[np.bool_], inverse: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Gives every row of a scan the verdict on its point.

    Args:
        points: The verdicts, bool (M,).
        inverse: Point of each row, int64 (N,); -1 for invalid rows, which are not rain.
    """
    rain = np.zeros(len(inverse), bool)
    judged = inverse >= 0
    rain[judged] = points[inverse[judged]]
    return rain
