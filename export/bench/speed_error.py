"""Draws a bench."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from derain.export.bench.contestant import FILE_SIZE, Contestant
from derain.export.bench.contestants import LEARNT, TRIVIAL
from derain.export.bench.rows import Row
from derain.pictures.scan_pictures import save
from derain.pictures.speed_error import Standing, speed_error_figure


def draw_speed_error(rows: Sequence[Row], facts: Mapping[str, Any], path: Path) -> None:
    """Writes the picture of error against time.

    Methods that could not be timed, or whose IoU is undefined, are left out.

    Args:
        rows: The rows of the table.
        facts: What the bench depends on besides its methods, as :class:`.bench.Bench` has it.
        path: PNG file to write.

    Raises:
        InputError: An output that cannot be written.
    """
    standings = [
        Standing(
            row.title,
            1 - row.scores.pooled.iou,
            row.milliseconds,
            group_of(row.contestant),
            row.contestant.facts.get(FILE_SIZE),
        )
        for row in rows
        if row.cost.failure is None and not math.isnan(row.scores.pooled.iou)
    ]
    title = f"{facts['title']}, {facts['processor']}"
    save(speed_error_figure(standings, title), path)


def group_of(contestant: Contestant) -> str:
    """What kind of method it is: a ``network``, a ``filter`` or a ``baseline``."""
    if contestant.filter is not None:
        return "filter"
    return "baseline" if contestant.kind in (*LEARNT, *TRIVIAL) else "network"
