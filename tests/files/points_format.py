"""A format from outside derain, in one file: a line with the number of points, then one a point."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from derain.errors import InputError
from derain.files.columns import columns_of, scan_of
from derain.files.content import Content
from derain.files.format import FORMATS, Format
from derain.scan import Scan

COLUMNS = ("x", "y", "z", "intensity")


@dataclass(frozen=True)
class PointsHeader:
    """Whether there are remarks behind the points, which are not written."""

    left_out: tuple[str, ...]


@FORMATS.add(".pts")
class Points(Format):
    """Points under their number."""

    HELP = "points under a line with their number"
    DAMAGE = (ValueError, IndexError)

    def decode(self, content: Content, columns: Sequence[str]) -> Scan:
        """Reads x, y, z and intensity."""
        lines = content.data.decode("latin-1").splitlines()
        content.budget.reserve(32 * len(lines))
        count = int(lines[0])
        rows = [[float(word) for word in line.split()] for line in lines[1 : count + 1]]
        table = np.array(rows).reshape(count, len(COLUMNS))
        header = PointsHeader(("remarks",) if len(lines) > count + 1 else ())
        return scan_of(content.path, dict(zip(COLUMNS, table.T, strict=True)), header=header)

    def encode(self, path: Path, scan: Scan) -> bytes:
        """Writes x, y, z and intensity."""
        columns = columns_of(scan)
        if tuple(columns) != COLUMNS:
            raise InputError(path, "it holds x, y, z and intensity alone", "Write .npz.")
        rows = zip(*(column.tolist() for column in columns.values()), strict=True)
        lines = [str(len(scan)), *(" ".join(map(repr, row)) for row in rows)]
        return "".join(f"{line}\n" for line in lines).encode()
