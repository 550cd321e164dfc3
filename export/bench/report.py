"""A bench as CSV, JSON, Markdown and a picture."""

import csv
import io
import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from derain.cards.card import DataCard
from derain.evaluation.counts import SCORES, Counts, mean_over_scans
from derain.evaluation.published_tables import PaperTable, PublishedRow
from derain.evaluation.text_tables import markdown_table, number_text
from derain.export.bench.bench_entries import FILE_SIZE, LEARNT, TRIVIAL, BenchEntry
from derain.export.bench.rows import Row
from derain.export.timing import STAGES
from derain.files.atomic import write_text

SIMULATED_IS_EASY = (
    "**Simulated data.** Simulated rain is easier to find than real rain: these figures are no "
    "evidence of quality on real scans."
)

READING = """\
- precision, recall, F1 and IoU are rain's, counted over the points of all scans; `per scan` is the
  mean over scans. Points that a failed method left in a scan count as not found.
- `-` is a score that is undefined: precision where no point was called rain, recall where none is
  rain, F1 and IoU where neither holds. A mean over scans is over the scans that have the score.
- `IoU 95 %` is the bootstrap interval over scans, `behind best` that of the difference to the best
  IoU, on the same draws: an interval that reaches 0 shows no significant difference on these
  scans. Consecutive scans are alike, which makes both too narrow.
- ms are from file to mask, median and 95th percentile, each method alone in a process of its own
  and no search for neighbours shared. MiB is that process's largest resident memory, Python and its
  libraries included; `-` where the method could not be sent to one, and was timed in the program's.
- `position` uses only the places of rain in the training scans, `intensity` only that rain is dim
  and near; `all` and `none` use nothing. A method that does not beat them has learnt nothing."""


def write_report(rows: Sequence[Row], facts: Mapping[str, Any], out: Path) -> None:
    """Writes ``bench.json``, ``bench.csv`` and ``bench.md`` into a folder.

    Args:
        rows: The rows of the table.
        facts: Facts that the bench depends on besides its methods, as :class:`.bench.Bench` has it.
        out: The folder, made if missing.

    Raises:
        InputError: A folder that cannot be written.
    """
    content = {**facts, "rows": [row.as_dict() for row in rows]}
    for name, text in {
        "bench.json": json.dumps(content, indent=1, allow_nan=False) + "\n",
        "bench.csv": as_csv(rows),
        "bench.md": as_markdown(rows, facts) + "\n",
    }.items():
        write_text(out / name, text)


def as_csv(rows: Sequence[Row]) -> str:
    """One line a method; names of nested values are joined by dots, as in ``stages.view.p50``."""
    lines = [_flat(row.as_dict()) for row in rows]
    columns = list(dict.fromkeys(name for line in lines for name in line))
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(lines)
    return text.getvalue()


def as_markdown(rows: Sequence[Row], facts: Mapping[str, Any]) -> str:
    """Tables of the whole, of classes, ranges, rain rates, sensors and stages."""
    points = sum(vars(rows[0].scores.pooled).values())
    parts = [
        f"# {facts['title']}, {points:,} points",
        f"    {facts['command']}",
        *([SIMULATED_IS_EASY] if facts["simulated"] else []),
        *(f"**{note}.**" for note in facts.get("notes", ())),
        main_table(rows),
        READING,
        "## Called rain, by class",
        _by_class(rows),
        "## IoU by range",
        _groups(rows, lambda row: row.scores.by_range),
    ]
    if rows[0].scores.by_rain_rate:
        parts += ["## IoU by rain rate", _groups(rows, lambda row: row.scores.by_rain_rate)]
    if rows[0].scores.by_sensor:
        parts += ["## IoU by sensor", _groups(rows, lambda row: row.scores.by_sensor)]
    parts += ["## Milliseconds by stage, median and 95th percentile", _by_stage(rows)]
    if failures := failures_of(rows):
        parts += ["## Failures", failures]
    return "\n\n".join([*parts, facts["versions"]])


# Columns of the main table that fit on a screen.
SHORT = ("method", "P", "R", "F1", "IoU", "IoU 95 %", "ms")


def main_table(rows: Sequence[Row], columns: Sequence[str] | None = None) -> str:
    """Error and cost of every method.

    Args:
        rows: The methods, one or more.
        columns: Titles of some of the columns; None for all.
    """
    cells = [_main_cells(row) for row in rows]
    titles = columns or [*cells[0]]
    return markdown_table(titles, [[of_row[title] for title in titles] for of_row in cells])


def draw_speed_error(rows: Sequence[Row], facts: Mapping[str, Any], path: Path) -> None:
    """Writes the picture of error against time.

    Methods that could not be timed, or whose IoU is undefined, are left out.

    Args:
        rows: The rows of the table.
        facts: Facts that the bench depends on besides its methods, as :class:`.bench.Bench` has it.
        path: PNG file to write.

    Raises:
        InputError: An output that cannot be written.
    """
    from derain.pictures.scan_pictures import save  # here: they load matplotlib
    from derain.pictures.speed_error import Standing, speed_error_figure

    standings = [
        Standing(
            row.title,
            1 - row.scores.pooled.iou,
            row.milliseconds,
            group_of(row.bench_entry),
            row.bench_entry.facts.get(FILE_SIZE),
        )
        for row in rows
        if row.cost.failure is None and not math.isnan(row.scores.pooled.iou)
    ]
    title = f"{facts['title']}, {facts['processor']}"
    save(speed_error_figure(standings, title), path)


def group_of(bench_entry: BenchEntry) -> str:
    """The kind of a method: ``network``, ``filter`` or ``baseline``."""
    if bench_entry.filter is not None:
        return "filter"
    return "baseline" if bench_entry.kind in (*LEARNT, *TRIVIAL) else "network"


def with_published_rows(
    table: PaperTable, ours: Mapping[str, Sequence[Row]], card: DataCard
) -> str:
    """Our rows below the published rows of the same method, in Markdown.

    Args:
        table: The table.
        ours: Our rows, by the names of the table's groups.
        card: Data card of our scans.
    """
    published = [row for row in table.rows if row.simulated == card.simulated]
    if not published:  # table II has no row on simulated rain
        published = list(table.rows)
    head = ["method", *("P", "R", "F1", "IoU"), "ms", "average"]
    parts = [f"# {table.title}", f"Ours on {card.title}."]
    for name, rows in ours.items():
        group = [row for row in published if row.group == name]
        parts += [f"## {name}", markdown_table(head, _beside(group, rows))]
    misprints = [
        f"(*) {row.method}, {row.group}: {row.misprint}." for row in published if row.misprint
    ]
    return "\n\n".join([*parts, *misprints])


def _main_cells(row: Row) -> dict[str, str]:
    """Cells of the main table by the titles of their columns."""
    values = row.as_dict()
    failed = row.scores.failures or row.cost.failure
    return {
        "method": f"{row.title} (!)" if failed else row.title,
        "P": number_text(values["precision"]),
        "R": number_text(values["recall"]),
        "F1": number_text(values["f1"]),
        "IoU": number_text(values["iou"]),
        "IoU 95 %": _interval(row.iou_interval),
        "behind best": _interval(row.behind_best),
        "F1 per scan": number_text(values["f1_per_scan"]),
        "IoU per scan": number_text(values["iou_per_scan"]),
        "ms": number_text(values["ms"], ",.1f"),
        "p95": number_text(values["ms_p95"], ",.1f"),
        "weights": f"{values['weights']:,}" if "weights" in values else "-",
        "MiB": number_text(row.cost.peak_memory, ",.0f"),
    }


def _by_class(rows: Sequence[Row]) -> str:
    """Share of each class that was called rain: recall of rain, false positives of the others."""
    present = {name: c for name, c in rows[0].scores.by_class.items() if c.points}
    head = ["method", *(f"{name}{' (rain)' if c.rain else ''}" for name, c in present.items())]
    return markdown_table(
        head,
        [
            [row.title, *(f"{row.scores.by_class[name].share_lost:.2%}" for name in present)]
            for row in rows
        ],
    )


def _groups(rows: Sequence[Row], groups_of: Callable[[Row], Mapping[str, Counts]]) -> str:
    names = list(groups_of(rows[0]))
    body = [[row.title, *(number_text(groups_of(row)[name].iou) for name in names)] for row in rows]
    return markdown_table(["method", *names], body)


def _by_stage(rows: Sequence[Row]) -> str:
    body = []
    for row in rows:
        times = row.as_dict()["stages"].values()
        cells = [[number_text(time[p], ",.1f") for p in ("p50", "p95")] for time in times]
        body.append([row.title, *map(" / ".join, cells)])
    return markdown_table(["method", *STAGES], body)


def failures_of(rows: Sequence[Row]) -> str:
    """Why methods failed, a line each; nothing where none did."""
    lines = []
    for row in rows:
        if failures := row.scores.failures:
            scan, reason = next(iter(failures.items()))
            scans = f"{len(failures)} of {len(row.scores.per_scan)} scans"
            lines.append(f"- {row.title}: {scans}, first {scan}: {reason}")
        if row.cost.failure:
            lines.append(f"- {row.title} could not be timed: {row.cost.failure}")
    return "\n".join(lines)


def _interval(interval: tuple[float, float] | None) -> str:
    return "-" if interval is None else f"{interval[0]:.3f} to {interval[1]:.3f}"


def _flat(values: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for name, value in values.items():
        if isinstance(value, Mapping):
            flat |= _flat(value, f"{prefix}{name}.")
        elif isinstance(value, list | tuple):
            flat |= _flat(dict(zip(("low", "high"), value, strict=True)), f"{prefix}{name}.")
        else:
            flat[prefix + name] = value
    return flat


def _beside(published: Sequence[PublishedRow], rows: Sequence[Row]) -> list[list[str]]:
    body = []
    for paper in published:
        body.append(_published_cells(paper))
        body += [_our_cells(row, paper.average) for row in rows if row.kind == paper.kind]
    kinds = {paper.kind for paper in published}
    return body + [_our_cells(row, "pooled") for row in rows if row.kind not in kinds]


def _published_cells(row: PublishedRow) -> list[str]:
    title = f"{row.method}, published{' (*)' if row.misprint else ''}"
    scores = [f"{score:.2f}" for score in row.scores]
    return [title, *scores, number_text(row.ms, "g"), row.average]


def _our_cells(row: Row, average: str) -> list[str]:
    pooled, per_scan = row.scores.pooled, row.scores.per_scan
    values = [
        getattr(pooled, score) if average == "pooled" else mean_over_scans(per_scan, score)
        for score in SCORES
    ]
    cells = (number_text(100 * value, ".2f") for value in values)
    return [f"{row.title}, ours", *cells, number_text(row.milliseconds, ".0f"), average]
