"""Filters: derainers that learn nothing.

One view of the neighbours serves them all (``filter_view``, ``PointFilter.judge``); one filter by
itself takes the shortest way to the same verdict (``PointFilter.judge_scan``).

They see the distinct positions of a scan (:class:`derain.views.neighbours.Neighbourhoods`).
Copies of a point count once: in a raw WADS scan 40 % of the rows are exact copies of others, and
every one of them would have a neighbour at distance 0, which no drop has. Rows that cannot be
judged are not rain.

A file of this folder enters by ``@FILTERS.add("its name")``, and needs to be named nowhere else:
:class:`PointFilter` describes what it brings with it.
"""

from derain.filters.crf import CRF as CRF
from derain.filters.derainer import FilterDerainer as FilterDerainer
from derain.filters.distance_filters import DSOR as DSOR
from derain.filters.distance_filters import SOR as SOR
from derain.filters.point_filter import FILTERS as FILTERS
from derain.filters.point_filter import PointFilter as PointFilter
from derain.filters.point_filter import Span as Span
from derain.filters.point_filter import filter_from as filter_from
from derain.filters.point_filter import filter_view as filter_view
from derain.filters.radius_filters import DROR as DROR
from derain.filters.radius_filters import ROR as ROR
from derain.filters.ssr import SSR as SSR
