"""A table across sensors as text, as JSON, and as a picture of error against time."""

import json
import shlex
import sys
from argparse import ArgumentParser
from collections.abc import Sequence
from pathlib import Path

from benchmarks.sensor_table.columns import Column, table
from benchmarks.sensor_table.measure import SIZE, TIME, Measurement
from derain.export.bench.report import group_of
from derain.export.timing import processor, versions
from derain.files.atomic import write_text
from derain.pictures.scan_pictures import save
from derain.pictures.speed_error import Standing, speed_error_figure

READING = """\
IoU of rain over the points of all scans of a column, points at one position once where the data
card says so. %: of the points that can be judged, where nothing is rain, the share that is called
so. ms: from file to mask, the median, each method alone in a process. -: not measured.
†: trained on some of these scans."""


def add_places(parser: ArgumentParser) -> None:
    """Declares the arguments for the places of files."""
    parser.add_argument("--shared", type=Path, default=Path("../shared"), help="scans, weights")
    parser.add_argument(
        "--work", type=Path, default=Path("runs/across_sensors"), help="what is made on the way"
    )
    parser.add_argument("--out", type=Path, required=True, help="folder to write the table to")
    parser.add_argument("--threads", type=int, default=2)


def report(measurement: Measurement, out: Path, turned: bool, notes: Sequence[str] = ()) -> None:
    """Measures; prints the table; and writes ``table.md``, ``table.json`` and the picture.

    Args:
        measurement: What is measured.
        out: Folder to write to, made if missing.
        turned: A row for each data set in place of each method.
        notes: Paragraphs that come below the table.
    """
    columns = list(measurement.columns())
    left_out = measurement.left_out.reasons
    measured = [
        title for title in measurement.plan.methods if any(title in c.cells for c in columns)
    ]
    parts = [
        f"    {_command()}",
        table(columns, measured, turned),
        READING,
        *notes,
        "\n".join(f"- {what} is left out: {why}" for what, why in left_out.items()),
        versions(),
    ]
    text = "\n\n".join(part for part in parts if part)
    print(text)
    content = {
        "command": _command(),
        "methods": {title: dict(measurement.rows[title].facts) for title in measured},
        "columns": [column.as_dict() for column in columns],
        "notes": list(notes),
        "left_out": left_out,
        "versions": versions(),
    }
    for name, written in {
        "table.md": text,
        "table.json": json.dumps(content, indent=1, allow_nan=False),
    }.items():
        write_text(out / name, written + "\n")
    _draw(measurement, {column.title: column for column in columns}, out / "speed_error.png")


def _draw(measurement: Measurement, columns: dict[str, Column], path: Path) -> None:
    """Draws error against time on the scans that methods were timed on, if they were."""
    plan = measurement.plan
    if TIME not in columns or plan.timed not in columns:
        return
    error, times, sizes = (columns[name].cells for name in (plan.timed, TIME, SIZE))
    standings = [
        Standing(
            title,
            1 - error[title].value,
            times[title].value,
            group_of(measurement.rows[title]),
            round(1e3 * sizes[title].value) if title in sizes else None,
        )
        for title in times
    ]
    save(speed_error_figure(standings, f"{plan.timed}, {processor()}"), path)


def _command() -> str:
    module = Path(sys.argv[0]).stem
    return f"python -m benchmarks.{module} {shlex.join(sys.argv[1:])}"
