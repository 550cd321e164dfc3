"""The tables of the REHEARSE-3D paper, and ours beside them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from typing import Literal

import yaml

from derain.cards.card import DataCard
from derain.datamodules.base import ScanDataModule
from derain.datamodules.labelled import full_name
from derain.errors import InputError
from derain.evaluation.counts import SCORES
from derain.export.bench.rows import Row
from derain.export.markdown import markdown_table
from derain.sources.frame import Frame

TABLES = ("table2", "table3")


@dataclass(frozen=True)
class PublishedRow:
    """A row as it is printed.

    Attributes:
        method: What the paper calls the method.
        kind: What derain calls it.
        group: Part of the split in table II, rain in table III.
        scores: Precision, recall, F1 and IoU of rain, in percent.
        ms: Milliseconds, where the table has them.
        average: How the scores agree with each other: pooled over points, or the mean over scans.
        simulated: On rain simulated by the paper's authors, not on REHEARSE-3D.
        misprint: What the row's own figures contradict.
    """

    method: str
    kind: str
    group: str
    scores: tuple[float, float, float, float]
    ms: float | None = None
    average: Literal["pooled", "scans"] = "pooled"
    simulated: bool = False
    misprint: str | None = None


@dataclass(frozen=True)
class PaperTable:
    """A table of the paper.

    Attributes:
        title: What it shows.
        groups: Part of the split, or rain rate in mm/h, by the name of a group.
        rows: Its rows.
    """

    title: str
    groups: Mapping[str, str | float]
    rows: Sequence[PublishedRow]


def paper_table(name: str) -> PaperTable:
    """One of ``TABLES``, as published.

    Source: A. M. Raisuddin et al., "REHEARSE-3D: A Multi-modal Emulated Rain Dataset for 3D Point
        Cloud De-raining", tables II and III.
    """
    file = resources.files("derain.export.bench").joinpath("paper_tables.yaml")
    table = yaml.safe_load(file.read_text("utf-8"))[name]
    rows = [PublishedRow(**{**row, "scores": tuple(row["scores"])}) for row in table["rows"]]
    return PaperTable(table["title"], table["groups"], rows)


def files_by_group(
    table: PaperTable, data: ScanDataModule, rates: Mapping[str, float]
) -> dict[str, Sequence[Frame]]:
    """The scans that each group of a table is measured on.

    Args:
        table: The table.
        data: A data set with a split.
        rates: Rain rate of each sequence in mm/h, which table III asks for.

    Raises:
        InputError: No scan belongs to any group.
    """
    if all(isinstance(group, str) for group in table.groups.values()):
        return {name: data.frames(part) for name, part in table.groups.items()}  # type: ignore[arg-type]
    files = data.frames("test")
    groups = {
        name: [file for file in files if rates.get(file.sequence) == rate]
        for name, rate in table.groups.items()
    }
    if not any(groups.values()):
        raise InputError(
            "--data",
            f"no test scan is known to have {', '.join(map(str, table.groups.values()))} mm/h",
            'Give --rain-rates: a YAML file with lines such as "005": 25.',
        )
    return {name: files for name, files in groups.items() if files}


def beside_published(table: PaperTable, ours: Mapping[str, Sequence[Row]], card: DataCard) -> str:
    """Our rows under the published ones of the same method, in Markdown.

    Args:
        table: The table.
        ours: Our rows, by the names of the table's groups.
        card: Data card of our scans.
    """
    published = [row for row in table.rows if row.simulated == card.simulated]
    if not published:  # table II knows no simulated rain
        published = list(table.rows)
    head = ["method", *("P", "R", "F1", "IoU"), "ms", "average"]
    parts = [f"# {table.title}", f"Ours on {full_name(card)}."]
    for name, rows in ours.items():
        group = [row for row in published if row.group == name]
        parts += [f"## {name}", markdown_table(head, _beside(group, rows))]
    misprints = [
        f"(*) {row.method}, {row.group}: {row.misprint}." for row in published if row.misprint
    ]
    return "\n\n".join([*parts, *misprints])


def _beside(published: Sequence[PublishedRow], rows: Sequence[Row]) -> list[list[str]]:
    body = []
    for paper in published:
        body.append(_published_cells(paper))
        body += [
            _our_cells(row, paper.average) for row in rows if row.contestant.kind == paper.kind
        ]
    kinds = {paper.kind for paper in published}
    return body + [_our_cells(row, "pooled") for row in rows if row.contestant.kind not in kinds]


def _published_cells(row: PublishedRow) -> list[str]:
    title = f"{row.method}, published{' (*)' if row.misprint else ''}"
    scores = [f"{score:.2f}" for score in row.scores]
    return [title, *scores, "-" if row.ms is None else f"{row.ms:g}", row.average]


def _our_cells(row: Row, average: str) -> list[str]:
    values = row.as_dict()
    suffix = "" if average == "pooled" else "_per_scan"
    scores = [f"{100 * values[score + suffix]:.2f}" for score in SCORES]
    ms = "-" if values["ms"] is None else f"{values['ms']:.0f}"
    return [f"{row.title}, ours", *scores, ms, average]
