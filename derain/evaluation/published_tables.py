"""The tables of the REHEARSE-3D paper, with rows of our own."""

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, Protocol, TypeVar

from derain.cards.card import DataCard
from derain.errors import InputError
from derain.evaluation.counts import SCORES, mean_over_scans
from derain.evaluation.text_tables import markdown_table, number_text
from derain.files.documents import Entry
from derain.files.packaged import packaged

if TYPE_CHECKING:
    from derain.evaluation.scores import Scores

Item = TypeVar("Item")

TABLES = ("table2", "table3")


@dataclass(frozen=True)
class PublishedRow:
    """A row as it is printed.

    Attributes:
        method: The method's name in the paper.
        kind: Its name in derain.
        group: Part of the split in table II, rain in table III.
        scores: Precision, recall, F1 and IoU of rain, in percent.
        ms: Milliseconds, where the table has them.
        average: The average that fits the scores: pooled over points, or the mean over scans.
        simulated: On rain simulated by the paper's authors, not on REHEARSE-3D.
        misprint: A contradiction among the row's own figures.
    """

    method: str
    kind: str
    group: str
    scores: tuple[float, float, float, float]
    ms: float | None = None
    average: Literal["pooled", "scans"] = "pooled"
    simulated: bool = False
    misprint: str | None = None


class MeasuredRow(Protocol):
    """A row of our own: a measured method."""

    @property
    def title(self) -> str:
        """The method's title."""

    @property
    def kind(self) -> str:
        """Name of its network, filter or baseline."""

    @property
    def scores(self) -> "Scores":
        """Its scores."""

    @property
    def milliseconds(self) -> float:
        """Median time from file to mask; NaN where it could not be timed."""


@dataclass(frozen=True)
class PaperTable:
    """A table of the paper.

    Attributes:
        title: Its title.
        groups: Part of the split or rain rate in mm/h, by the name of the group.
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
    file = packaged("derain.evaluation")["published_tables"]
    table = Entry.of_yaml(file).members()[name].value
    rows = [PublishedRow(**{**row, "scores": tuple(row["scores"])}) for row in table["rows"]]
    return PaperTable(table["title"], table["groups"], rows)


def scans_by_group(
    table: PaperTable,
    scans_of_part: Callable[[str], Sequence[Item]],
    rain_rate_of: Callable[[Item], float | None],
) -> Mapping[str, Sequence[Item]]:
    """The scans that each group of a table is measured on.

    Args:
        table: The table.
        scans_of_part: The scans of a part of our split, ``validation`` or ``test``.
        rain_rate_of: Rain rate of a scan in mm/h, for table III; None where it is not known.

    Raises:
        InputError: No scan belongs to any group.
    """
    parts = {name: part for name, part in table.groups.items() if isinstance(part, str)}
    if parts:
        return {name: scans_of_part(part) for name, part in parts.items()}
    by_rate: dict[float | None, list[Item]] = defaultdict(list)
    for scan in scans_of_part("test"):
        by_rate[rain_rate_of(scan)].append(scan)
    groups: dict[str, Sequence[Item]] = {
        name: by_rate[rate] for name, rate in table.groups.items() if rate in by_rate
    }
    if not groups:
        raise InputError(
            "--data",
            f"no test scan is known to have {', '.join(map(str, table.groups.values()))} mm/h",
            'Give --rain-rates: a YAML file with lines such as "005": 25.',
        )
    return groups


def beside_published(
    table: PaperTable, ours: Mapping[str, Sequence[MeasuredRow]], card: DataCard
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


def _beside(published: Sequence[PublishedRow], rows: Sequence[MeasuredRow]) -> list[list[str]]:
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


def _our_cells(row: MeasuredRow, average: str) -> list[str]:
    pooled, per_scan = row.scores.pooled, row.scores.per_scan
    values = [
        getattr(pooled, score) if average == "pooled" else mean_over_scans(per_scan, score)
        for score in SCORES
    ]
    cells = (number_text(100 * value, ".2f") for value in values)
    return [f"{row.title}, ours", *cells, number_text(row.milliseconds, ".0f"), average]
