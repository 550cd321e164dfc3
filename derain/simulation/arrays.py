"""Types of arrays, and arrays whose rows belong together."""

from collections.abc import Iterable
from dataclasses import dataclass, fields
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Columns:
    """Arrays of one length, each an attribute of a class derived from this one."""

    def take(self, rows: NDArray[Any]) -> Self:
        """The rows of a mask, bool (N,), or by their numbers, int64 (M,)."""
        return type(self)(*(getattr(self, column.name)[rows] for column in fields(self)))

    @classmethod
    def joined(cls, parts: Iterable[Self]) -> Self:
        """The rows of several, one after the other."""
        rows = list(parts)
        columns = ([getattr(part, column.name) for part in rows] for column in fields(cls))
        return cls(*map(np.concatenate, columns))
