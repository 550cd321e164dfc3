"""What a data set holds: scans and points by class and by rain rate."""

import csv
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from glob import glob
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from derain.cards.known import known_layouts
from derain.errors import InputError
from derain.files import count_points, find_scans
from derain.files.labels import LABEL, label_beside, read_labels, semantic
from derain.files.names import scan_stem
from derain.files.reading import reading
from derain.simulation.manifest import RAIN_RATE, read_manifest

# Folders of scans and of their labels, as the packaged data cards have them.
LAYOUTS = tuple((layout.scans, layout.labels) for layout in known_layouts())


@dataclass(frozen=True)
class SequenceFiles:
    """One sequence of a data set.

    Attributes:
        name: Its name.
        scans: Its scans, in order.
        rain_rate: Rain rate in mm/h; None where nothing says it.
    """

    name: str
    scans: Sequence[Path]
    rain_rate: float | None


@dataclass
class Tally:
    """What was counted.

    Attributes:
        sequences: Sequences.
        scans: Scans.
        points: Points.
        labelled: Points by semantic class id; those of scans without labels are not among them.
    """

    sequences: int = 0
    scans: int = 0
    points: int = 0
    labelled: Counter[int] = field(default_factory=Counter)

    def add(self, other: "Tally") -> None:
        """Adds what another counted."""
        self.sequences += other.sequences
        self.scans += other.scans
        self.points += other.points
        self.labelled.update(other.labelled)

    def as_dict(self, classes: Mapping[int, str]) -> dict[str, Any]:
        """Counts, and points and their share by the name of the class, as JSON knows them.

        Where there are labels, every class is named, also those that no point has.
        """
        total = self.labelled.total()
        ids = sorted({*self.labelled, *classes}) if total else []
        points = {class_name(id_, classes): self.labelled[id_] for id_ in ids}
        return {
            "sequences": self.sequences,
            "scans": self.scans,
            "points": self.points,
            "labelled_points": total,
            "points_by_class": points,
            "class_share": {name: count / total for name, count in points.items()},
        }


def class_name(id_: int, classes: Mapping[int, str]) -> str:
    """Name of a class, also of one that its data card does not know."""
    return classes.get(id_, f"class {id_}")


def rate_name(rate: float | None) -> str:
    """What a rain rate is called in tables and pictures."""
    return "rain unknown" if rate is None else f"{rate:g} mm/h" if rate else "clean"


def find_layout(root: Path) -> tuple[str, str] | None:
    """Names of the folders of scans and labels in a data set; None where none is known."""
    return next((layout for layout in LAYOUTS if _scan_folders(root, layout)), None)


def find_sequences(root: Path, layout: tuple[str, str] | None) -> list[SequenceFiles]:
    """The sequences of a data set, by name.

    Args:
        root: A folder with a folder ``sequences``, the folder of sequences, a sequence, its folder
            of scans, or any folder of scans, which counts as one sequence.
        layout: Names of a sequence's folders of scans and labels; None for a folder of scans.

    Raises:
        InputError: A folder that holds nothing of this kind, or a damaged weather record.
    """
    if layout is None:
        return [SequenceFiles(root.absolute().name, find_scans([root]), None)]
    folders = _scan_folders(root, layout)
    if not folders:
        raise InputError(
            root, f"no sequence in it has a folder {layout[0]}", "Name its folders with --layout."
        )
    rates = manifest_of(root).get(RAIN_RATE, {})
    sequences = []
    for folder in folders:
        name = folder.absolute().parent.name
        rate = rates[name] if name in rates else _recorded_rate(folder.parent / "weather")
        sequences.append(SequenceFiles(name, find_scans([folder]), rate))
    return sequences


def manifest_of(root: Path) -> dict[str, Any]:
    """The manifest of the simulated data set that a folder is, or is part of; empty if of none.

    Args:
        root: The data set, its folder ``sequences``, a sequence, or a sequence's folder of scans.
    """
    root = root.absolute()
    return next(filter(None, map(read_manifest, (root, *root.parents[:3]))), {})


def count_scan(path: Path, layout: tuple[str, str] | None, columns: Sequence[str]) -> Tally:
    """Counts the points of a scan, by class where it has labels.

    Args:
        path: The scan.
        layout: Names of its folder and that of its labels; None looks for them beside it.
        columns: Names of the columns of files that do not name them.

    Raises:
        InputError: A scan that cannot be read, or labels that do not belong to it.
    """
    points = count_points(path, columns)
    tally = Tally(scans=1, points=points)
    labels = (
        label_beside(path)
        if layout is None
        else path.parent.parent / layout[1] / f"{scan_stem(path)}{LABEL}"
    )
    if labels.is_file():
        counts = np.bincount(semantic(read_labels(labels, points)))
        tally.labelled.update({int(id_): int(counts[id_]) for id_ in np.flatnonzero(counts)})
    return tally


def _scan_folders(root: Path, layout: tuple[str, str]) -> list[Path]:
    scans, labels = layout
    if root.absolute().name == scans and (root.absolute().parent / labels).is_dir():
        return [root]
    for sequences in ("sequences/*/", "*/", ""):
        # Not Path.glob, which finds hidden folders too: what `derain simulate` has not finished.
        if found := glob(f"{sequences}{scans}/", root_dir=root):
            return [root / folder for folder in sorted(found)]
    return []


def _recorded_rate(weather: Path) -> float | None:
    """Median rain rate of the weather records of a sequence, mm/h, if they state any."""
    rates = []
    for record in sorted(weather.glob("*.csv")):
        with reading(record, ValueError, csv.Error), record.open(newline="") as lines:
            rates += [float(row[RAIN_RATE]) for row in csv.DictReader(lines) if row.get(RAIN_RATE)]
    measured = [rate for rate in rates if math.isfinite(rate)]  # a gauge that fails writes nan
    return median(measured) if measured else None
