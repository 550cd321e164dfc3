"""Parameters that a user gives by name, for what is made of them."""

from collections.abc import Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Any, TypeVar

from derain.errors import InputError, did_you_mean

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Made = TypeVar("Made", bound="DataclassInstance")


def made_of(kind: type[Made], name: str, parameters: Mapping[str, Any]) -> Made:
    """Makes a dataclass of parameters that a user gave by name.

    Args:
        kind: The dataclass, which looks at the values itself.
        name: What the user calls what they are of.
        parameters: Some of its fields.

    Raises:
        InputError: A parameter that is no field of it, or a value that it refuses.
    """
    known = [field.name for field in fields(kind)]
    if unknown := sorted(set(parameters) - set(known)):
        raise InputError(
            name,
            f"it has no parameter {', '.join(unknown)}",
            f"{did_you_mean(unknown[0], known)}It has {', '.join(known)}.",
        )
    return kind(**parameters)
