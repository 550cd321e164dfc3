"""What ``derain info`` says of a folder: scans and points by class and by rain rate."""

import argparse
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tqdm import tqdm

from derain.cards.card import DataCard, load_card
from derain.cards.known import card_by_folders
from derain.cards.layout import Layout
from derain.errors import InputError
from derain.evaluation.text_tables import plain_table
from derain.sources.contents import (
    Tally,
    class_name,
    count_scan,
    find_layout,
    find_sequences,
    manifest_of,
    rate_name,
)


@dataclass(frozen=True)
class FolderFacts:
    """What is in a folder of scans.

    Attributes:
        folder: The folder.
        layout: Names of its folders of scans and labels; None where scans lie directly in it.
        card: Name of the data card that names the classes; None where none does.
        classes: Names of the classes, by id.
        tallies: What was counted, by rain rate in mm/h in ascending order; None last, for where it
            is not known.
    """

    folder: Path
    layout: tuple[str, str] | None
    card: str | None
    classes: Mapping[int, str]
    tallies: Mapping[float | None, Tally]

    @property
    def total(self) -> Tally:
        """What was counted at all rain rates together."""
        total = Tally()
        for tally in self.tallies.values():
            total.add(tally)
        return total

    def as_dict(self) -> dict[str, Any]:
        """The same as JSON knows it."""
        return {
            "folder": str(self.folder),
            "layout": self.layout,
            "card": self.card,
            **self.total.as_dict(self.classes),
            "by_rain_rate": {
                "unknown" if rate is None else f"{rate:g}": tally.as_dict(self.classes)
                for rate, tally in self.tallies.items()
            },
        }

    def as_text(self) -> str:
        """The same as a table: a line a class, a column a rain rate."""
        total, names = self.total, [rate_name(rate) for rate in self.tallies]
        columns = [total, *self.tallies.values()]
        rows = [["", "all", "share", *names]]
        for title in ("sequences", "scans", "points"):
            counts = [f"{getattr(tally, title):,}" for tally in columns]
            rows.append([title, counts[0], "", *counts[1:]])
        for id_ in sorted(total.labelled):
            counts = [f"{tally.labelled[id_]:,}" for tally in columns]
            share = f"{total.labelled[id_] / total.labelled.total():.3%}"
            rows.append([class_name(id_, self.classes), counts[0], share, *counts[1:]])
        return f"{self.folder} ({self._explained})\n{plain_table(rows)}"

    @property
    def _explained(self) -> str:
        layout = "a folder of scans" if self.layout is None else " and ".join(self.layout)
        return f"{layout}; classes: {self.card or 'no data card'}"


def facts_of_folder(folder: Path, arguments: argparse.Namespace) -> FolderFacts:
    """Counts what is in a folder.

    Args:
        folder: The folder.
        arguments: Those of ``derain info``.

    Raises:
        InputError: A folder without scans, a file in it that cannot be read, or no such data card.
    """
    layout = find_layout(folder) if arguments.layout is None else _stated(arguments.layout)
    card = _card(folder, layout, arguments.card)
    sequences = find_sequences(folder, layout)
    rates = sorted(
        {sequence.rain_rate for sequence in sequences}, key=lambda rate: (rate is None, rate or 0)
    )
    tallies = {rate: Tally() for rate in rates}
    scans = sum(len(sequence.scans) for sequence in sequences)
    with tqdm(total=scans, unit="scan", disable=None) as progress:
        for sequence in sequences:
            tally = tallies[sequence.rain_rate]
            tally.sequences += 1
            for scan in sequence.scans:
                tally.add(count_scan(scan, layout, arguments.columns))
                progress.update()
    classes = card.classes if card else {}
    return FolderFacts(folder, layout, card.name if card else None, classes, tallies)


def draw(facts: FolderFacts, picture: Path) -> None:
    """Draws what was counted.

    Raises:
        InputError: The picture cannot be written.
    """
    from derain.pictures.data_statistics import statistics_figure
    from derain.pictures.scan_pictures import save

    total = facts.total
    title = f"{facts.folder.absolute().name}: {total.scans:,} scans, {total.points:,} points"
    save(statistics_figure(facts.tallies, facts.classes, title), picture)


def _stated(layout: str) -> tuple[str, str]:
    folders = layout.split(",")
    if len(folders) != 2:
        raise InputError(
            "--layout", f"'{layout}' does not name two folders", "Give e.g. velodyne,labels."
        )
    scans, labels = folders
    return scans, labels


def _card(folder: Path, layout: tuple[str, str] | None, name: str | None) -> DataCard | None:
    if name is None and manifest_of(folder):
        name = "simulated"
    elif name is None and layout is not None:
        return card_by_folders(Layout(scans=layout[0], labels=layout[1]), "classes")
    return None if name is None else load_card(name)
