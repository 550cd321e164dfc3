"""What every filter is: a few numbers, and a verdict on each point from its neighbourhood."""

from abc import ABC, abstractmethod
from dataclasses import asdict, dataclass, fields
from numbers import Integral, Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from derain.errors import InputError
from derain.files.documents import shown
from derain.views.neighbours import Neighbourhoods

# No published filter looks at more than 51, and a search for thousands would fill the memory.
MOST_NEIGHBOURS = 200

# Beyond any limit that a filter may know, and a square of it is still a number.
LARGEST = 1e100


@dataclass(frozen=True)
class PointFilter(ABC):
    """A derainer that learns nothing: it looks at each point's nearest neighbours.

    A subclass is a frozen dataclass; its parameters besides ``neighbours`` are numbers, or names.

    Attributes:
        neighbours: k, the points of a neighbourhood that the filter looks at, the point itself
            included.

    Raises:
        InputError: ``neighbours`` that is not a whole number from 2 to 200, or another number that
            is negative, not finite or above 1e100.
    """

    neighbours: int

    def __post_init__(self) -> None:
        _check_neighbours(self.name, self.neighbours)
        for parameter in fields(self):
            if parameter.type is float:
                _check_number(self.name, parameter.name, getattr(self, parameter.name))

    @property
    def name(self) -> str:
        """What the filter is called on the command line."""
        return type(self).__name__.lower()

    @abstractmethod
    def judge(self, view: Neighbourhoods) -> NDArray[np.bool_]:
        """Says which points are rain.

        Args:
            view: One scan with at least ``neighbours`` neighbours a point; more are not looked at,
                so that one view serves several filters.

        Returns:
            True for rain, bool (M,), M being the points of the view.
        """

    def as_dict(self) -> dict[str, Any]:
        """The parameters by name, as primitives."""
        return asdict(self)


def _check_neighbours(filter_name: str, value: Any) -> None:
    whole = isinstance(value, Integral) and not isinstance(value, bool)
    if not (whole and 2 <= value <= MOST_NEIGHBOURS):
        raise InputError(
            filter_name,
            f"neighbours is {shown(value)}",
            f"Give a whole number from 2 (the point itself and one more) to {MOST_NEIGHBOURS}.",
        )


def _check_number(filter_name: str, parameter: str, value: Any) -> None:
    number = isinstance(value, Real) and not isinstance(value, bool)
    if not (number and 0 <= value <= LARGEST):
        raise InputError(
            filter_name,
            f"{parameter} is {shown(value)}",
            f"Give a finite number that is not negative, {LARGEST:g} at most.",
        )
