"""The tables of the REHEARSE-3D paper, and the scans that each of their groups is measured on."""

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, TypeVar

from derain.errors import InputError
from derain.files.documents import Entry, packaged

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
