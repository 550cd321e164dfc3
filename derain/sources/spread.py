"""Some of many, spread over all of them."""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

Item = TypeVar("Item")


def evenly_spaced(items: Sequence[Item], most: int) -> list[Item]:
    """At most ``most`` items, spread over the whole sequence.

    Args:
        items: The items, in order.
        most: The largest number.
    """
    numbers = np.linspace(0, len(items) - 1, min(most, len(items))).round().astype(int)
    return [items[number] for number in numbers]
