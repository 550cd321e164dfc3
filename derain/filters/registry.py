"""Filters by name: those of this folder, and those that other packages bring."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from derain.errors import InputError, did_you_mean
from derain.files.documents import short
from derain.system.registry import Registry, from_parameters

if TYPE_CHECKING:
    from derain.filters.point_filter import PointFilter

FILTERS: "Registry[type[PointFilter]]" = Registry("derain.filters")


def filter_from(name: str, parameters: Mapping[str, Any]) -> "PointFilter":
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
