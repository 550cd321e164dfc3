"""How much a teacher calls rain, not rain and not known, by range."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from derain.evaluation.counts import ratio
from derain.evaluation.text_tables import number_text, plain_table
from derain.scan import Scan
from derain.teaching.labels import CLASSES

# Where the bands of ranges start, metres; the last is open.
STARTS = (0, 10, 20, 40, 80)


class TaughtShares:
    """Counts the points that can be judged, by range and by what a teacher says of them.

    Attributes:
        table: Points by band of ``STARTS`` and by class of ``CLASSES``, int64 (5, 3).
    """

    def __init__(self) -> None:
        self.table = np.zeros((len(STARTS), len(CLASSES)), np.int64)

    def add(self, scan: Scan, labels: NDArray[np.uint32]) -> NDArray[np.float64]:
        """Counts the points of a scan.

        Args:
            scan: The scan, N points.
            labels: What the teacher says of them, uint32 (N,).

        Returns:
            Shares of the classes in its points, in the order of ``CLASSES``, float64 (3,); NaN
            where it has none that can be judged.
        """
        rows = np.flatnonzero(scan.valid)
        band = np.searchsorted(STARTS, scan.range[rows], side="right") - 1
        column = np.searchsorted(list(CLASSES), labels[rows])
        table = np.zeros_like(self.table)
        np.add.at(table, (band, column), 1)
        self.table += table
        return ratio(table.sum(axis=0), table.sum())

    @property
    def rain(self) -> int:
        """Points called rain."""
        return int(self.table[:, 1].sum())

    def __str__(self) -> str:
        names = [f"{start}-{end} m" for start, end in pairwise(STARTS)]
        names.append(f"{STARTS[-1]}+ m")
        rows = [_row(name, counts) for name, counts in zip(names, self.table, strict=True)]
        head = ["range", "points", *CLASSES.values()]
        return plain_table([head, *rows, _row("all", self.table.sum(axis=0))])


def _row(name: str, counts: NDArray[np.int64]) -> Sequence[str]:
    shares = ratio(counts, counts.sum())
    return [name, f"{counts.sum():,}", *(number_text(share, ".1%") for share in shares)]
