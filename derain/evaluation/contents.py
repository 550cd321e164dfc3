"""Counts of a data set: scans and points by class and by rain rate."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

import numpy as np

from derain.cards.layout import Layout
from derain.files import DEFAULT_COLUMNS
from derain.files.names import scan_stem
from derain.jobs.running import ValueWork
from derain.simulation.manifest import RAIN_RATE, manifest_of
from derain.sources.folders import frames_of, named_frames
from derain.sources.recordings import recordings_of
from derain.sources.search import listed_scans, scan_folders
from derain.sources.source import Frames, Source
from derain.sources.units import FrameUnit


@dataclass
class Contents:
    """Numbers of sequences, scans and points.

    Attributes:
        sequences: Sequences.
        scans: Scans.
        points: Points.
        labelled: Points of labelled scans, by semantic class id.
    """

    sequences: int = 0
    scans: int = 0
    points: int = 0
    labelled: Counter[int] = field(default_factory=Counter)

    def add(self, other: "Contents") -> None:
        """Adds the numbers of another."""
        self.sequences += other.sequences
        self.scans += other.scans
        self.points += other.points
        self.labelled.update(other.labelled)

    @classmethod
    def from_json(cls, counted: Mapping[str, Any]) -> Self:
        """Reads the counts of :meth:`FrameCounting.value`."""
        labelled = Counter({int(id_): points for id_, points in counted["labelled"].items()})
        return cls(0, counted["scans"], counted["points"], labelled)

    def as_dict(self, classes: Mapping[int, str]) -> dict[str, Any]:
        """Numbers, and points and their share by the name of the class, as JSON-able primitives.

        Where there are labels, classes without points are named, too.
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
    """Name of a class; ``class <id>`` where the data card does not name it."""
    return classes.get(id_, f"class {id_}")


def rate_name(rate: float | None) -> str:
    """Name of a rain rate in tables and pictures."""
    return "rain unknown" if rate is None else f"{rate:g} mm/h" if rate else "clean"


def find_sequences(
    root: Path,
    layout: Layout | None,
    columns: Sequence[str] = DEFAULT_COLUMNS,
    layouts: Sequence[Layout] | None = None,
) -> list[tuple[Source, float | None]]:
    """The sequences of a data set, by name.

    Args:
        root: A folder with a folder of sequences, the folder of sequences, a sequence, its folder
            of scans, or any folder of scans, which counts as one sequence.
        layout: Names of its folders; None for a folder of scans, or of recordings.
        columns: Names of the columns of files that do not name them.
        layouts: Names of the folders of recordings that may be sequences of data sets; by default
            those in the packaged data cards.

    Returns:
        The scans of each, in order, and where their labels are or should be; and its rain rate in
        mm/h, None where it is not known.

    Raises:
        InputError: A folder without sequences or scans.
    """
    if layout is None:
        recordings = recordings_of(named_frames(root, columns, labelled=True, layouts=layouts))
        return [(Frames(each), None) for each in recordings]
    rates = manifest_of(root).get(RAIN_RATE, {})
    sequences: list[tuple[Source, float | None]] = []
    for folder in scan_folders(root, layout):
        name = folder.absolute().parent.name
        scans = listed_scans([folder])
        keys = [f"{name}/{scan_stem(scan)}" for scan in scans]
        frames = frames_of(scans, layout.label_of, columns, keys)
        sequences.append((frames, rates.get(name)))
    return sequences


class FrameCounting(ValueWork[FrameUnit]):
    """Counts the scans and points of units."""

    def value(self, unit: FrameUnit) -> dict[str, Any]:
        """The counts of a unit, by class where there are labels, for :meth:`Contents.from_json`.

        Raises:
            InputError: A scan that cannot be read, or labels that do not belong to it.
        """
        points, labelled = 0, Counter[str]()
        for frame in unit.frames:
            of_frame = frame.count_points()
            points += of_frame
            if frame.has_labels:
                counts = np.bincount(frame.read_label(of_frame))
                labelled.update({str(id_): int(counts[id_]) for id_ in np.flatnonzero(counts)})
        return {"scans": len(unit.frames), "points": points, "labelled": dict(labelled)}
