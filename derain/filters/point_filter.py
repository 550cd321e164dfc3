"""What every filter is: a few numbers, and a verdict on each point from its neighbourhood."""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, fields
from numbers import Integral, Real
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from derain.errors import InputError
from derain.files.documents import shown
from derain.filters.filter_view import filter_view, rain_among
from derain.filters.registry import FILTERS
from derain.scan import Scan
from derain.system.stopwatch import Stopwatch
from derain.views.candidates import Candidates
from derain.views.neighbours import Neighbourhoods
from derain.views.scan_issues import ScanIssue

# The most that a filter may look at. No published one looks at more than 51, and a search for
# thousands would fill the memory.
MOST_FILTER_NEIGHBOURS = 200

# Beyond any limit that a filter may know, and a square of it is still a number.
LARGEST_NUMBER = 1e100

# Smallest and largest value of a parameter, whole numbers or not.
Span = tuple[int, int] | tuple[float, float]

# Which rows are rain, and which were judged at all, bool (N,) each.
RainAndJudged = tuple[NDArray[np.bool_], NDArray[np.bool_]]

# Where derain's own filters look for the best number of neighbours. Tuning finds as many of every
# point as the largest says, and keeps them in memory for all trials.
TUNED_NEIGHBOURS: Span = (2, 12)


@dataclass(frozen=True)
class PointFilter(ABC):
    """A derainer that learns nothing: it looks at each point's nearest neighbours.

    A subclass is a frozen dataclass; its parameters besides ``neighbours`` are numbers, or names.
    It is found by the name that it is registered by, in which there is no dot, for what has a
    suffix is a file. It brings with it all that there is to know of it::

        @FILTERS.add("near")
        @dataclass(frozen=True)
        class Near(PointFilter):
            HELP: ClassVar[str] = "rain is whatever is near"
            SPACE: ClassVar[Mapping[str, Span]] = {"reach": (0.5, 50.0)}

            neighbours: int = 2
            reach: float = 5.0

            def judge(self, view: Neighbourhoods) -> NDArray[np.bool_]:
                return np.linalg.norm(view.points[:, :3], axis=1) < self.reach

    Attributes:
        HELP: What rain is to the filter, in one line for the help of commands.
        SPACE: Where each parameter is looked for by ``derain tune``; those not named stay as they
            are by default. Whole numbers are drawn evenly, all else evenly in its logarithm: what
            fits one sensor may be a tenth of what fits another. A filter without any is not tuned.
        neighbours: k, the points of a neighbourhood that the filter looks at, the point itself
            included.

    Raises:
        InputError: ``neighbours`` that is not a whole number from 2 to 200, or another number that
            is negative, not finite or above 1e100.
    """

    HELP: ClassVar[str] = ""
    SPACE: ClassVar[Mapping[str, Span]] = MappingProxyType({})

    neighbours: int

    def __post_init__(self) -> None:
        _check_neighbours(self.name, self.neighbours)
        for parameter in fields(self):
            if parameter.type in (float, "float"):  # the text, where annotations are put off
                _check_number(self.name, parameter.name, getattr(self, parameter.name))

    @property
    def name(self) -> str:
        """What the filter is registered by; of one that is not, the name of its class."""
        return FILTERS.name_of(type(self)) or type(self).__name__.lower()

    @abstractmethod
    def judge(self, view: Neighbourhoods) -> NDArray[np.bool_]:
        """Says which points are rain.

        Args:
            view: One scan with at least ``neighbours`` neighbours a point; more are not looked at,
                so that one view serves several filters.

        Returns:
            True for rain, bool (M,), M being the points of the view.
        """

    def judge_scan(
        self, scan: Scan, threads: int, candidates: Candidates | None, stopwatch: Stopwatch
    ) -> RainAndJudged:
        """Says which rows of a scan are rain, as :meth:`judge` does of every point of a view.

        A filter that comes to the same verdict without every point's neighbours goes its shorter
        way here.

        Args:
            scan: The scan, of N rows.
            threads: Threads to use.
            candidates: Bounds outside which nothing is rain; None where anything may be.
            stopwatch: Takes the times of the stages view, network (the filter) and back.

        Returns:
            Rows that are rain, and those that were judged, bool (N,) each.
        """
        with stopwatch.stage("view"):
            view = filter_view(self.neighbours, threads)(scan)
        with stopwatch.stage("network"):
            rain = rain_among(self, view, scan, candidates)
        with stopwatch.stage("back"):
            return view.back(rain.astype(np.float32)) > 0, view.judged

    def issues(self, scan: Scan) -> Iterator[ScanIssue]:
        """What is odd about a scan for this filter; nothing, for one that looks at places alone.

        Args:
            scan: The scan, before it is judged.
        """
        return iter(())

    def as_dict(self) -> dict[str, Any]:
        """The parameters by name, as primitives."""
        return asdict(self)


def _check_neighbours(filter_name: str, value: Any) -> None:
    whole = isinstance(value, Integral) and not isinstance(value, bool)
    if not (whole and 2 <= value <= MOST_FILTER_NEIGHBOURS):
        raise InputError(
            filter_name,
            f"neighbours is {shown(value)}",
            "Give a whole number from 2 (the point itself and one more) to "
            f"{MOST_FILTER_NEIGHBOURS}.",
        )


def _check_number(filter_name: str, parameter: str, value: Any) -> None:
    number = isinstance(value, Real) and not isinstance(value, bool)
    if not (number and 0 <= value <= LARGEST_NUMBER):
        raise InputError(
            filter_name,
            f"{parameter} is {shown(value)}",
            f"Give a finite number that is not negative, {LARGEST_NUMBER:g} at most.",
        )
