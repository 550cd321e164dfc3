"""Filters: derainers that learn nothing.

One view of the neighbours serves them all (``filter_view``, ``PointFilter.judge``); one filter by
itself takes the shortest way to the same verdict (``FilterDerainer``).

They see the distinct valid positions of a scan (:class:`derain.views.neighbours.Neighbourhoods`).
Copies of a point count once: in a raw WADS scan 40 % of the rows are exact copies of others, and
every one of them would have a neighbour at distance 0, which no drop has. Rows that cannot be
judged are not rain.
"""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from derain.errors import InputError
from derain.files.documents import short
from derain.filters.derainer import FilterDerainer, filter_view
from derain.filters.dror import DROR
from derain.filters.dsor import DSOR
from derain.filters.parameters import read_parameters
from derain.filters.point_filter import PointFilter
from derain.filters.ror import ROR
from derain.filters.sor import SOR
from derain.filters.ssr import SSR

__all__ = [
    "DROR",
    "DSOR",
    "FILTERS",
    "ROR",
    "SOR",
    "SSR",
    "FilterDerainer",
    "PointFilter",
    "filter_from",
    "filter_view",
    "read_parameters",
]

FILTERS: dict[str, type[PointFilter]] = {
    "ror": ROR,
    "sor": SOR,
    "dror": DROR,
    "dsor": DSOR,
    "ssr": SSR,
}


def filter_from(name: str, parameters: Mapping[str, Any]) -> PointFilter:
    """Makes a filter.

    Args:
        name: One of ``FILTERS``.
        parameters: Its parameters by name; those not given have their defaults.

    Raises:
        InputError: No such filter, no such parameter, or a value that it cannot have.
    """
    if name not in FILTERS:
        raise InputError(short(name), "no such filter", f"Give one of {', '.join(FILTERS)}.")
    known = [field.name for field in fields(FILTERS[name])]
    if unknown := sorted(set(parameters) - set(known)):
        raise InputError(
            name, f"it has no parameter {', '.join(unknown)}", f"It has {', '.join(known)}."
        )
    return FILTERS[name](**parameters)
