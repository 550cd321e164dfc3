"""Tables as text, with columns that line up."""

import math
from collections.abc import Sequence


def number_text(value: float | None, form: str = ".3f") -> str:
    """A number as text; ``-`` where it is undefined or unknown.

    Args:
        value: The number; NaN or None where there is none.
        form: Its format, as Python's ``format`` takes it.
    """
    return "-" if value is None or math.isnan(value) else format(value, form)


def markdown_table(head: Sequence[str], body: Sequence[Sequence[str]]) -> str:
    """A table in Markdown with padded cells; the first column is aligned to the left.

    Args:
        head: Titles of the columns.
        body: The cells of each row.
    """
    rows = [[_in_markdown(cell) for cell in cells] for cells in (head, *body)]
    widths = _widths(rows)
    lines = [f"| {' | '.join(_padded(cells, widths))} |" for cells in rows]
    rule = "|".join(["", "-" * (widths[0] + 2), *("-" * (w + 1) + ":" for w in widths[1:]), ""])
    return "\n".join([lines[0], rule, *lines[1:]])


def plain_table(rows: Sequence[Sequence[str]]) -> str:
    """An indented table without lines; the first column is aligned to the left.

    Args:
        rows: The cells of each row.
    """
    widths = _widths(rows)
    return "\n".join(f"  {'  '.join(_padded(cells, widths))}".rstrip() for cells in rows)


def _in_markdown(cell: str) -> str:
    """A cell on one line, without an end of the cell in it."""
    return " ".join(cell.split()).replace("|", "\\|")


def _widths(rows: Sequence[Sequence[str]]) -> list[int]:
    return [max(map(len, column)) for column in zip(*rows, strict=True)]


def _padded(cells: Sequence[str], widths: Sequence[int]) -> list[str]:
    """Cells padded to the widths of their columns, the first aligned to the left."""
    return [
        cell.rjust(width) if number else cell.ljust(width)
        for number, (cell, width) in enumerate(zip(cells, widths, strict=True))
    ]
