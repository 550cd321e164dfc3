"""The base class of filters: a few parameters, and a verdict on each point by its neighbourhood."""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, fields
from types import MappingProxyType
from typing import Any, ClassVar, Literal, get_args, get_origin

import numpy as np

from derain.errors import InputError, did_you_mean
from derain.files.documents import Entry, short
from derain.scan import Bools, Ints, Scan
from derain.system.registry import Registry, from_parameters
from derain.system.stopwatch import Stopwatch
from derain.views.candidates import Candidates
from derain.views.neighbours import Neighbourhoods, NeighbourView
from derain.views.scan_issues import ScanIssue

# Filters by name: those of this folder, and those that other packages bring.
FILTERS: Registry[type["PointFilter"]] = Registry("derain.filters", base="PointFilter")

# The most that a filter may look at. No published one looks at more than 51, and a search for
# thousands would fill the memory.
MOST_FILTER_NEIGHBOURS = 200

# Beyond any limit of a filter, and a square of it is still a number.
LARGEST_NUMBER = 1e100

# Smallest and largest value of a parameter, whole numbers or not.
Span = tuple[int, int] | tuple[float, float]

# Which of M points are rain, bool (M,), and the point of each row of a scan, int64 (N,); -1 for
# rows that cannot be judged.
RainAndPoints = tuple[Bools, Ints]

# Where derain's own filters look for the best number of neighbours. Tuning finds as many of every
# point as the largest asks for, and keeps them in memory for all trials.
TUNED_NEIGHBOURS: Span = (2, 12)


@dataclass(frozen=True)
class PointFilter(ABC):
    """A derainer that learns nothing: it looks at each point's nearest neighbours.

    A subclass is a frozen dataclass; its parameters besides ``neighbours`` are numbers, or names.
    It is found by the name that it is registered by, in which there is no dot, for what has a
    suffix is a file. It brings all that derain needs of it::

        @FILTERS.add("near")
        @dataclass(frozen=True)
        class Near(PointFilter):
            HELP: ClassVar[str] = "rain is whatever is near"
            SPACE: ClassVar[Mapping[str, Span]] = {"reach": (0.5, 50.0)}

            neighbours: int = 2
            reach: float = 5.0

            def judge(self, view: Neighbourhoods) -> Bools:
                return np.linalg.norm(view.points[:, :3], axis=1) < self.reach

    Attributes:
        HELP: The filter's definition of rain, in one line for the help of commands.
        SPACE: Where each parameter is looked for by ``derain tune``; those not named stay as they
            are by default. Whole numbers are drawn evenly, all else evenly in its logarithm: what
            fits one sensor may be a tenth of what fits another. A filter without any is not tuned.
        FEWEST_NEIGHBOURS: The fewest that it can look at.
        neighbours: k, the points of a neighbourhood that the filter looks at, the point itself
            included.

    Raises:
        InputError: ``neighbours`` that is not a whole number from the fewest to 200, another number
            that is negative, not finite or above 1e100, or none of the names that a ``Literal``
            lists.
    """

    HELP: ClassVar[str] = ""
    SPACE: ClassVar[Mapping[str, Span]] = MappingProxyType({})
    FEWEST_NEIGHBOURS: ClassVar[int] = 2  # the point itself and one more

    neighbours: int

    def __post_init__(self) -> None:
        for parameter in fields(self):
            value = getattr(self, parameter.name)
            if isinstance(value, np.generic):  # records and fingerprints hold primitives
                value = value.item()
                object.__setattr__(self, parameter.name, value)
            entry = Entry(self.name, parameter.name, value)
            if parameter.name == "neighbours":
                entry.whole(self.FEWEST_NEIGHBOURS, MOST_FILTER_NEIGHBOURS)
            elif parameter.type in (float, "float"):  # the text, where annotations are put off
                entry.within(0, LARGEST_NUMBER)
            elif get_origin(parameter.type) is Literal:
                entry.one_of(get_args(parameter.type))

    @property
    def name(self) -> str:
        """The registered name of the filter; if there is none, the name of its class."""
        name: str = vars(type(self)).get("NAME", type(self).__name__.lower())
        return name

    @abstractmethod
    def judge(self, view: Neighbourhoods) -> Bools:
        """Returns which points are rain.

        Args:
            view: One scan with at least ``neighbours`` neighbours a point; more are not looked at,
                so that one view serves several filters.

        Returns:
            True for rain, bool (M,), M being the points of the view.
        """

    def judge_scan(
        self, scan: Scan, threads: int, candidates: Candidates | None, stopwatch: Stopwatch
    ) -> RainAndPoints:
        """Finds the rain of a scan, as :meth:`judge` does of every point of a view.

        A filter that comes to the same verdict without every point's neighbours goes its shorter
        way here.

        Args:
            scan: The scan, of N rows.
            threads: Threads to use.
            candidates: Bounds outside which nothing is rain; None where anything may be.
            stopwatch: Takes the times of the stages view and network (the filter).

        Returns:
            Which of the scan's distinct valid positions are rain, bool (M,), and the position of
            each row, int64 (N,); -1 for rows that cannot be judged.
        """
        with stopwatch.stage("view"):
            view = filter_view(self.neighbours, threads)(scan)
        with stopwatch.stage("network"):
            return rain_among(self, view, scan, candidates), view.inverse

    def issues(self, scan: Scan) -> Iterator[ScanIssue]:
        """Warnings about a scan for this filter; nothing, for one that looks at places alone.

        Args:
            scan: The scan, before it is judged.
        """
        return iter(())

    def as_dict(self) -> dict[str, Any]:
        """The parameters by name, as primitives."""
        return asdict(self)


def filter_from(name: str, parameters: Mapping[str, Any]) -> PointFilter:
    """Makes a filter.

    Args:
        name: One of ``FILTERS``.
        parameters: Its parameters by name; those not given have their defaults.

    Raises:
        InputError: No such filter, no such parameter, or a value that it cannot have.
    """
    if name not in FILTERS:
        remedy = f"{did_you_mean(name, FILTERS)}Give one of {', '.join(FILTERS)}."
        raise InputError(short(name), "no such filter", remedy)
    return from_parameters(FILTERS[name], name, parameters)


def filter_view(neighbours: int, threads: int = 0) -> NeighbourView:
    """The view of a scan for filters.

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
    filter: PointFilter, view: Neighbourhoods, scan: Scan, candidates: Candidates | None
) -> Bools:
    """The points that a filter calls rain among candidates.

    A filter looks at all points to find what is usual, whether or not they are candidates. So its
    verdict on a candidate is that without bounds.

    Args:
        filter: The filter.
        view: View of the scan, M points.
        scan: The scan.
        candidates: Bounds outside which nothing is rain; None where anything may be.

    Returns:
        True for rain, bool (M,).

    Raises:
        InputError: The filter, which may be of another package, answers something else.
    """
    rain = np.asarray(filter.judge(view))
    if (rain.dtype, rain.shape) != (np.dtype(bool), (view.size,)):
        raise InputError(
            filter.name,
            f"its answer for {view.size} points is {rain.dtype} {rain.shape}",
            f"Repair the filter: judge returns bool ({view.size},).",
        )
    return rain if candidates is None else rain & candidates.among(scan)[view.first]


def rows_of(points: Bools, inverse: Ints) -> Bools:
    """Gives every row of a scan the verdict on its point.

    Args:
        points: The verdicts, bool (M,).
        inverse: Point of each row, int64 (N,); -1 for rows at no point, which are not rain.
    """
    # The last place is for rows at no point, whose number is -1.
    return np.append(points, False).take(inverse)
