"""Exact counts of what a method calls rain, scan by scan, in NumPy alone."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from derain.errors import InputError
from derain.evaluation.counts import Counts, ratio
from derain.scan import Scan

# Where range bands start, metres; the last is open.
RANGE_EDGES = (0, 10, 20, 40, 80)


@dataclass(frozen=True)
class ClassCounts:
    """What became of the points of one semantic class.

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
        """Points judged wrongly: rain that was left, or others that were called rain."""
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

    :class:`~derain.evaluation.metrics.RainMetrics` counts the same of batches while a network is
    trained, on its device and across processes.

    Args:
        classes: Name of every semantic class, by id.
        rain: Ids of the classes that count as rain.
        range_edges: Where the range bands start, metres, rising from 0; the last band is open.
        unknown: Ids of the classes that are not counted, for nobody knows whether they are rain.

    Raises:
        InputError: Two classes of one name, rain that is no known class, or edges that do not rise
            from 0.
    """

    def __init__(
        self,
        classes: Mapping[int, str],
        rain: Collection[int],
        range_edges: Sequence[float] = RANGE_EDGES,
        unknown: Collection[int] = (),
    ) -> None:
        classes = {id_: name for id_, name in classes.items() if id_ not in unknown}
        check_classes(classes, rain, range_edges)
        self.unknown = [*unknown]
        self.ids = np.array(sorted(classes), np.int64)
        self.names = [classes[id_] for id_ in self.ids.tolist()]
        self.is_rain = np.isin(self.ids, [*rain])
        self.range_edges = tuple(range_edges)
        # Points by class, range band and whether they were called rain.
        self._cells = np.zeros((len(self.ids), len(self.range_edges), 2), np.int64)
        self._per_scan: list[Counts] = []

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
        row = self._class_rows(scan.label[known])
        called = called_rain[known]
        cell = (row * len(self.range_edges) + self._bands(scan.range[known])) * 2 + called
        counted = np.bincount(cell, minlength=self._cells.size)
        self._cells += counted.reshape(self._cells.shape)
        self._per_scan.append(Counts.of(called, self.is_rain[row]))

    def pooled(self) -> Counts:
        """Counts over the points of all scans."""
        return self._counts(self._cells.sum(axis=1))

    def per_scan(self) -> list[Counts]:
        """Counts of each scan, in the order in which they were added."""
        return list(self._per_scan)

    def by_class(self) -> dict[str, ClassCounts]:
        """What became of each semantic class, by name."""
        return {
            name: ClassCounts(kept + called_rain, called_rain, rain)
            for name, rain, (kept, called_rain) in zip(
                self.names, self.is_rain.tolist(), self._cells.sum(axis=1).tolist(), strict=True
            )
        }

    def by_range(self) -> dict[str, Counts]:
        """Counts of each range band, by ``band_names``."""
        names = band_names(self.range_edges)
        return {name: self._counts(self._cells[:, band]) for band, name in enumerate(names)}

    def _class_rows(self, label: NDArray[np.int64]) -> NDArray[np.int64]:
        strange = label[~np.isin(label, self.ids)]
        if len(strange):
            raise unknown_class(int(strange[0]))
        return np.searchsorted(self.ids, label).astype(np.int64)

    def _bands(self, range: NDArray[np.floating]) -> NDArray[np.int64]:
        inner_edges = np.array(self.range_edges[1:], range.dtype)
        finite_or_far = np.where(np.isfinite(range), range, np.inf)
        return np.searchsorted(inner_edges, finite_or_far, side="right").astype(np.int64)

    def _counts(self, table: NDArray[np.int64]) -> Counts:
        """Joins the classes of an int64 (classes, 2) table of points kept and called rain."""
        false_negative, true_positive = table[self.is_rain].sum(axis=0).tolist()
        true_negative, false_positive = table[~self.is_rain].sum(axis=0).tolist()
        return Counts(true_positive, false_positive, false_negative, true_negative)


def band_names(range_edges: Sequence[float]) -> list[str]:
    """Names of range bands, such as ``0-10 m`` and, of the last, ``80+ m``."""
    names = [f"{start:g}-{end:g} m" for start, end in pairwise(range_edges)]
    return [*names, f"{range_edges[-1]:g}+ m"]


def unknown_class(label: int) -> InputError:
    """What to say of a label that no class has."""
    return InputError(
        "labels", f"id {label} is no known class", "Name it among the data card's classes."
    )


def check_classes(
    classes: Mapping[int, str], rain: Collection[int], range_edges: Sequence[float]
) -> None:
    """Refuses what cannot be counted by.

    Raises:
        InputError: Two classes of one name, rain that is no known class, or edges that do not rise
            from 0.
    """
    if len(set(classes.values())) < len(classes):
        raise InputError("classes", "two ids have the same name", "Give each a name of its own.")
    if not set(rain) <= set(classes):
        raise InputError(
            "rain", f"{sorted(rain)} are not ids of classes", "Give ids that the classes name."
        )
    if list(range_edges[:1]) != [0] or not all(a < b for a, b in pairwise(range_edges)):
        raise InputError(
            "range_edges", f"{list(range_edges)} do not rise from 0", "Give rising metres from 0."
        )
