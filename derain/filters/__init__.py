"""Filters: derainers that learn nothing.

One view of the neighbours serves them all (``filter_view``, ``PointFilter.judge``); one filter by
itself takes the shortest way to the same verdict (``PointFilter.judge_scan``).

They see the distinct valid positions of a scan (:class:`derain.views.neighbours.Neighbourhoods`).
Copies of a point count once: in a raw WADS scan 40 % of the rows are exact copies of others, and
every one of them would have a neighbour at distance 0, which no drop has. Rows that cannot be
judged are not rain.

A file of this folder enters by ``@FILTERS.add("its name")``, and needs to be named nowhere else:
:class:`PointFilter` says what it brings with it.
"""

from derain.filters.crf import CRF
from derain.filters.derainer import FilterDerainer
from derain.filters.dror import DROR
from derain.filters.dsor import DSOR
from derain.filters.filter_view import filter_view
from derain.filters.parameters import read_parameters
from derain.filters.point_filter import PointFilter, Span
from derain.filters.registry import FILTERS, filter_from
from derain.filters.ror import ROR
from derain.filters.sor import SOR
from derain.filters.ssr import SSR

__all__ = [
    "CRF",
    "DROR",
    "DSOR",
    "FILTERS",
    "ROR",
    "SOR",
    "SSR",
    "FilterDerainer",
    "PointFilter",
    "Span",
    "filter_from",
    "filter_view",
    "read_parameters",
]
