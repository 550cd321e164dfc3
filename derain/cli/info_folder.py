"""Facts that ``derain info`` prints about a folder: scans and points by class and rain rate."""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from derain.cards.card import DataCard, load_card
from derain.cards.known import card_by_folders, layouts_for
from derain.cards.layout import Layout
from derain.cli.unit_options import shard_of
from derain.errors import counted
from derain.evaluation.contents import (
    Contents,
    FrameCounting,
    class_name,
    find_sequences,
    rate_name,
)
from derain.evaluation.text_tables import plain_table
from derain.example import example_folder
from derain.jobs.running import Submits, Task, values
from derain.simulation.manifest import manifest_of
from derain.sources.frame import Frame
from derain.sources.search import find_layout
from derain.sources.units import Division, FrameUnit, folder_of_paths, shared_options, units_of

# What a data card is chosen by. Names of folders that many data sets have make it a guess.
CardRestsOn = Literal["--card", "manifest", "names of folders"]
FOLDER_NAMES: CardRestsOn = "names of folders"


@dataclass(frozen=True)
class FolderFacts:
    """The contents of a folder of scans.

    Attributes:
        folder: The folder.
        folders: Names of its folders of scans and labels; None where scans lie directly in it, or
            in folders of recordings.
        card: The data card that names the classes; None where none does.
        card_rests_on: Evidence for the card.
        by_rain_rate: Counts by rain rate in mm/h in ascending order; None last, for
            where it is not known.
    """

    folder: Path
    folders: Sequence[str] | None
    card: DataCard | None
    card_rests_on: CardRestsOn
    by_rain_rate: Mapping[float | None, Contents]

    @property
    def classes(self) -> Mapping[int, str]:
        """Names of the classes, by id; none without a data card."""
        return {} if self.card is None else self.card.classes

    @property
    def total(self) -> Contents:
        """The counts of all rain rates together."""
        total = Contents()
        for contents in self.by_rain_rate.values():
            total.add(contents)
        return total

    def as_dict(self) -> dict[str, Any]:
        """The same as JSON-able primitives."""
        return {
            "folder": str(self.folder),
            "layout": self.folders,
            "card": None if self.card is None else self.card.name,
            "card_rests_on": None if self.card is None else self.card_rests_on,
            **self.total.as_dict(self.classes),
            "by_rain_rate": {
                "unknown" if rate is None else f"{rate:g}": contents.as_dict(self.classes)
                for rate, contents in self.by_rain_rate.items()
            },
        }

    def as_text(self) -> str:
        """The same as a table: a line a class, a column a rain rate."""
        total, names = self.total, [rate_name(rate) for rate in self.by_rain_rate]
        columns = [total, *self.by_rain_rate.values()]
        rows = [["", "all", "share", *names]]
        for title in ("sequences", "scans", "points"):
            counts = [f"{getattr(contents, title):,}" for contents in columns]
            rows.append([title, counts[0], "", *counts[1:]])
        for id_ in sorted(total.labelled):
            counts = [f"{contents.labelled[id_]:,}" for contents in columns]
            share = f"{total.labelled[id_] / total.labelled.total():.3%}"
            rows.append([class_name(id_, self.classes), counts[0], share, *counts[1:]])
        layout = "a folder of scans" if self.folders is None else " and ".join(self.folders)
        return f"{self.folder} ({layout}; classes: {self._card_explained})\n{plain_table(rows)}"

    @property
    def _card_explained(self) -> str:
        if self.card is None:
            return "no data card"
        if self.card_rests_on != FOLDER_NAMES or self.card.auto_detect == "rain":
            return self.card.name
        text = f"{self.card.name}, guessed from the names of the folders alone"
        labelled = self.total.labelled
        if labelled and not labelled.keys() & set(self.card.rain):
            rain = ", ".join(self.card.classes[id_] for id_ in self.card.rain)
            text += f"; no point is {rain}, so that it may be another data set: give --card"
        return text


def facts_of_folder(
    folder: Path, arguments: argparse.Namespace, executor: Submits | None
) -> FolderFacts | None:
    """Counts what is in a folder.

    Args:
        folder: The folder.
        arguments: The options of the command.
        executor: Counts the units; None counts them in this process.

    Returns:
        The counts; None while other shards are to be counted.

    Raises:
        InputError: A folder without scans, a file in it that cannot be read, or no such data card;
            records of another folder.
    """
    records, division = arguments.out, Division()
    if records is not None:
        division = Division(shard=shard_of(arguments), anew=arguments.anew)
    card = None if arguments.card is None else load_card(arguments.card)
    layouts = layouts_for(card)
    layout = find_layout(folder, layouts)
    folders = None if layout is None else [layout.scans, layout.labels]
    card, rests_on = (card, "--card") if card else _card(folder, layout)
    sequences = find_sequences(folder, layout, arguments.columns, layouts)
    rates = {rate for _, rate in sequences}
    ascending = sorted(rates, key=lambda rate: (rate is None, rate or 0))
    by_rain_rate = {rate: Contents() for rate in ascending}
    # In this process units are of one scan, so that a progress bar counts scans.
    block = 1 if records is None and executor is None else division.block
    frames: list[Frame] = []
    units: list[FrameUnit] = []
    rate_of_unit: list[float | None] = []
    for frames_of_sequence, rate in sequences:
        by_rain_rate[rate].sequences += 1
        of_sequence = units_of(frames_of_sequence, None, block)
        frames += frames_of_sequence
        units += of_sequence
        rate_of_unit += [rate] * len(of_sequence)
    job, shard = None, units
    if records is not None:
        options = shared_options("info", frames, block)
        options |= {"folder": str(folder), "layout": folders}
        job, shard = division.begin(records, options, units)
    places = () if records is None else (records,)
    task = Task(job, FrameCounting(), folder_of_paths(frames, *places))
    counted = values(task, units, shard, executor, "counting")
    if counted is None:
        return None
    for rate, counts in zip(rate_of_unit, counted, strict=True):
        by_rain_rate[rate].add(Contents.from_json(counts))
    return FolderFacts(folder, folders, card, rests_on, by_rain_rate)


def draw(facts: FolderFacts, picture: Path) -> None:
    """Draws what was counted.

    Raises:
        InputError: The picture cannot be written.
    """
    from derain.pictures.data_statistics import statistics_figure
    from derain.pictures.scan_pictures import save

    total = facts.total
    scans = counted(total.scans, "scan")
    title = f"{facts.folder.absolute().name}: {scans}, {total.points:,} points"
    save(statistics_figure(facts.by_rain_rate, facts.classes, title), picture)


def _card(folder: Path, layout: Layout | None) -> tuple[DataCard | None, CardRestsOn]:
    """The data card guessed for a folder, and the evidence for it."""
    if manifest_of(folder) or folder == example_folder():
        return load_card("simulated"), "manifest"
    return (None if layout is None else card_by_folders(layout, "classes")), FOLDER_NAMES
