"""One column of a table across sensors, and how it is written."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from derain.evaluation.text_tables import markdown_table

# Stands behind what a method scores on scans that it was trained on.
LEARNT_MARK = " †"


@dataclass(frozen=True)
class Cell:
    """The entry of one method in one column.

    Attributes:
        value: An IoU, a share, milliseconds or kilobytes.
        learnt: True if the method was trained on some of the column's scans.
        counts: Points behind the value, by what they are and were called.
    """

    value: float
    learnt: bool = False
    counts: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class Column:
    """A column.

    Attributes:
        title: Its heading.
        unit: ``IoU``, ``%`` (its values are shares), ``ms`` or ``kB``.
        cells: By title of the method; a method that has none is not here.
        about: What was measured, for whoever repeats it.
    """

    title: str
    unit: str
    cells: Mapping[str, Cell]
    about: Mapping[str, Any] = field(default_factory=dict)

    @property
    def heading(self) -> str:
        """Its title, and its unit where it is not IoU."""
        return self.title if self.unit == "IoU" else f"{self.title}, {self.unit}"

    def text(self, method: str) -> str:
        """A method's entry as text of the table."""
        cell = self.cells.get(method)
        if cell is None or math.isnan(cell.value):
            return "-"
        return _written(cell.value, self.unit) + (LEARNT_MARK if cell.learnt else "")

    def as_dict(self) -> dict[str, Any]:
        """The column as JSON-able primitives."""
        return asdict(self)


def table(columns: Sequence[Column], methods: Sequence[str], data_in_rows: bool = False) -> str:
    """The table in Markdown.

    Args:
        columns: The columns.
        methods: Titles of the methods, in order.
        data_in_rows: A row for each column, and a column for each method, for a narrow page.
    """
    cells = [
        ["method", *methods],
        *([c.heading, *(c.text(method) for method in methods)] for c in columns),
    ]
    if not data_in_rows:
        cells = [list(row) for row in zip(*cells, strict=True)]
    return markdown_table(cells[0], cells[1:])


def _written(value: float, unit: str) -> str:
    match unit:
        case "IoU":
            return f"{value:.3f}".removeprefix("0") if value else "0"
        case "%":
            return _percentage(100 * value)
    return f"{value:,.0f}" if value >= 10 else f"{value:.1f}"


def _percentage(value: float) -> str:
    """With enough decimals that one point of a hundred thousand is not printed as none."""
    if not value:
        return "0"
    decimals = 3 if value < 1 else 2 if value < 10 else 1
    return f"{value:.{decimals}f}".removeprefix("0")
