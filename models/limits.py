"""Limits of a network's hyper-parameters, from a user or a file."""

import math
from collections.abc import Mapping
from typing import Any

from derain.files.documents import Entry, shown
from derain.views.neighbours import MOST_NETWORK_NEIGHBOURS

# Its multiples, by what an optimiser divides it by, still are numbers of 32 bits.
LARGEST_COMPUTABLE = 1e30

# The least and the greatest of each number. A network reads only those that it has.
LIMITS = {
    **dict.fromkeys(("learning_rate", "weight_decay", "decay"), (0, LARGEST_COMPUTABLE)),
    **dict.fromkeys(("balance", "warm_up"), (0, LARGEST_COMPUTABLE)),
    **dict.fromkeys(("final_share", "momentum", "dropout", "threshold"), (0, 1)),
    "without_intensity": (-LARGEST_COMPUTABLE, LARGEST_COMPUTABLE),
}


def check_hyperparameters(
    parameters: Mapping[str, Entry], defaults: Mapping[str, Any] = {}
) -> None:
    """Refuses hyper-parameters that no network can be trained with.

    Args:
        parameters: Each by its name; a network may have others than those limited here.
        defaults: The network's own, which they are to be like; those not named may be anything.

    Raises:
        InputError: Anything but plain values, numbers that are not finite or out of their limits,
            or values of another kind than the defaults.
    """
    for name, entry in parameters.items():
        _require_plain_values(entry)
        _refuse_another_kind(entry, defaults.get(name))
        if name in LIMITS:
            entry.within(*LIMITS[name])
        elif name == "neighbours":
            entry.whole(1, MOST_NETWORK_NEIGHBOURS)


def _require_plain_values(entry: Entry) -> None:
    left, seen = [entry.value], set[int]()
    while left:
        value = left.pop()
        if isinstance(value, list | tuple | dict):
            if id(value) not in seen:  # a file may hold one list in itself, or in a million places
                left += value.values() if isinstance(value, dict) else value
            seen.add(id(value))
        elif isinstance(value, float) and not math.isfinite(value):
            raise entry.fault(f"{value} is not finite", "Give a finite number.")
        elif not isinstance(value, str | bool | int | float | None):
            raise entry.fault(f"{shown(value)} is no plain value", "Give numbers and texts.")


def _refuse_another_kind(entry: Entry, default: Any) -> None:
    """Refuses what is not like a default that is a number, true or false, or some of a kind."""
    if isinstance(default, tuple) and default and isinstance(entry.value, list | tuple):
        for number, value in enumerate(entry.value):
            _refuse_another_kind(Entry(entry.source, f"{entry.key}[{number}]", value), default[0])
    elif isinstance(default, tuple):
        entry.items()
    elif isinstance(default, bool):
        entry.truth()
    elif isinstance(default, int | float):
        entry.number()
