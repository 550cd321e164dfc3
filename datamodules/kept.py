"""What is the same in every epoch, made once and kept while there is room."""

from collections.abc import Callable
from typing import Generic, TypeVar

import numpy as np
import torch

from derain.learning.batch import Sample
from derain.scan import Scan

Item = TypeVar("Item", Scan, Sample)

MEGABYTE = 2**20


class Kept(Generic[Item]):
    """Items by number, as many as there is room for.

    What came first stays. Every epoch asks for everything once, and whoever made room for the
    latest would have let go of each item by the time it is asked for again.

    Args:
        room: Bytes that the arrays of all items together may fill.
    """

    def __init__(self, room: int) -> None:
        self._left = room
        self._items: dict[int, Item] = {}

    def get(self, number: int, make: Callable[[], Item]) -> Item:
        """The item of a number: the one that was kept, or else a new one."""
        kept = self._items.get(number)
        if kept is not None:
            return kept
        made = make()
        size = bytes_of(made)
        if size <= self._left:
            self._left -= size
            self._items[number] = made
        return made


def bytes_of(item: object) -> int:
    """Bytes of the arrays of a scan or a sample; those of memory they share are counted twice."""
    match item:
        case np.ndarray() | torch.Tensor():
            return int(item.nbytes)
        case dict():
            return sum(map(bytes_of, item.values()))
        case list() | tuple():
            return sum(map(bytes_of, item))
        case _ if hasattr(item, "__dict__") and not callable(item):
            return bytes_of(vars(item))
    return 0
