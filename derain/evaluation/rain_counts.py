"""Exact counts of the points that a method calls rain, by scan, class and range, in NumPy alone."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from derain.errors import InputError
from derain.evaluation.counts import RANGE_EDGES, Counts, band_names, band_of, ratio, table_of
from derain.scan import Scan


@dataclass(frozen=True)
class ClassCounts:
    """Points of one semantic class, and those of them called rain.

    Attributes:
        points: Points of the class.
        called_rain: Those called rain.
        rain: Whether the class counts as rain.
    """

    points: int
    called_rain: int
    rain: bool

    @property
    def share_lost(self) -> float:
        """Share of the class called rain: its recall if it is rain, else its false positives.

        It is NaN for a class without points.
        """
        return float(ratio(self.called_rain, self.points))

    @property
    def wrong(self) -> int:
        """Points judged wrongly: rain that is kept, or other points that are called rain."""
        return self.points - self.called_rain if self.rain else self.called_rain

    @property
    def share_wrong(self) -> float:
        """Share of the class judged wrongly; NaN for a class without points."""
        return float(ratio(self.wrong, self.points))

    def __add__(self, other: "ClassCounts") -> "ClassCounts":
        """Counts of the points of two classes, or of two parts of one."""
        called_rain = self.called_rain + other.called_rain
        return ClassCounts(self.points + other.points, called_rain, self.rain)


class RainCounts:
    """Counts of one method's answers, by scan, class and range.

    :class:`~derain.evaluation.metrics.RainMetrics` adds them up across processes during training.

    Args:
        classes: Name of every semantic class, by id.
        rain: Ids of the classes that count as rain.
        unknown: Ids of the classes that are left out, because it is not known whether they are
            rain.

    Attributes:
        cells: Points by class, by band of range and by whether they are called rain, int64
            (classes, bands, 2).
        per_scan: Counts of each scan, in the order in which they were added.

    Raises:
        InputError: Two classes of one name, or rain that is no known class.
    """

    def __init__(
        self, classes: Mapping[int, str], rain: Collection[int], unknown: Collection[int] = ()
    ) -> None:
        classes = {id_: name for id_, name in classes.items() if id_ not in unknown}
        _check_classes(classes, rain)
        self.unknown = [*unknown]
        self.ids = np.array(sorted(classes), np.int64)
        self.names = [classes[id_] for id_ in self.ids.tolist()]
        self.is_rain = np.isin(self.ids, [*rain])
        self.cells = np.zeros((len(self.ids), len(RANGE_EDGES), 2), np.int64)
        self.per_scan: list[Counts] = []

    def add(self, scan: Scan, called_rain: NDArray[np.bool_]) -> None:
        """Counts the points of one labelled scan.

        Args:
            scan: A scan of N points, with labels. A range that is not finite belongs to the last
                band.
            called_rain: True for the points called rain, bool (N,).

        Raises:
            InputError: A scan without labels, or a label that is no class.
        """
        if scan.label is None:
            raise InputError(scan.name, "it has no labels", "Give its label file.")
        known = ~np.isin(scan.label, self.unknown)
        row, band = self._class_rows(scan.label[known]), band_of(scan.range[known])
        self.add_cells(table_of((row, band, called_rain[known].astype(np.int64)), self.cells.shape))

    def add_cells(self, cells: NDArray[np.int64]) -> None:
        """Adds the points of one scan that are counted already.

        Args:
            cells: Of the shape of :attr:`cells`.
        """
        self.cells += cells
        self.per_scan.append(self._counts(cells))

    def pooled(self) -> Counts:
        """Counts over the points of all scans."""
        return self._counts(self.cells)

    def pooled_over(self, ids: Collection[int]) -> Counts:
        """Counts over the points of some classes, such as those of one of several data sets."""
        return self._counts(self.cells * np.isin(self.ids, [*ids])[:, None, None])

    def by_class(self) -> dict[str, ClassCounts]:
        """Counts of each semantic class, by name."""
        bands = self.by_class_and_range().items()
        return {name: sum(others, first) for name, (first, *others) in bands}

    def by_range(self) -> dict[str, Counts]:
        """Counts of each band of range, by ``band_names``."""
        names = enumerate(band_names())
        return {name: self._counts(self.cells[:, band : band + 1]) for band, name in names}

    def by_class_and_range(self) -> dict[str, list[ClassCounts]]:
        """Counts of each semantic class, by name, in each band of ``band_names``."""
        rows = zip(self.names, self.is_rain.tolist(), self.cells.tolist(), strict=True)
        return {
            name: [ClassCounts(kept + called, called, rain) for kept, called in bands]
            for name, rain, bands in rows
        }

    def _class_rows(self, label: NDArray[np.int64]) -> NDArray[np.int64]:
        strange = label[~np.isin(label, self.ids)]
        if len(strange):
            raise InputError(
                "labels",
                f"id {int(strange[0])} is no known class",
                "Name it among the data card's classes.",
            )
        return np.searchsorted(self.ids, label).astype(np.int64)

    def _counts(self, cells: NDArray[np.int64]) -> Counts:
        """Adds up the points of some cells, int64 (classes, any bands, 2)."""
        false_negative, true_positive = cells[self.is_rain].sum(axis=(0, 1)).tolist()
        true_negative, false_positive = cells[~self.is_rain].sum(axis=(0, 1)).tolist()
        return Counts(true_positive, false_positive, false_negative, true_negative)


def _check_classes(classes: Mapping[int, str], rain: Collection[int]) -> None:
    if len(set(classes.values())) < len(classes):
        raise InputError("classes", "two ids have the same name", "Give each a name of its own.")
    if not set(rain) <= set(classes):
        raise InputError(
            "rain", f"{sorted(rain)} are not ids of classes", "Give ids that the classes name."
        )
