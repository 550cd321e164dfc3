"""Filters by name: those of this folder, and those that other packages bring."""

from collections.abc import Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Any

from derain.errors import InputError
from derain.files.documents import short
from derain.system.registry import Registry

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
        raise InputError(short(name), "no such filter", f"Give one of {', '.join(FILTERS)}.")
    known = [field.name for field in fields(FILTERS[name])]
    if unknown := sorted(set(parameters) - set(known)):
        raise InputError(
            name, f"it has no parameter {', '.join(unknown)}", f"It has {', '.join(known)}."
        )
    return FILTERS[name](**parameters)
