"""How well a network finds rain while it is trained and tested: counts of batches, as a metric."""

from collections.abc import Collection, Mapping, Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torchmetrics import Metric
from torchmetrics.utilities import dim_zero_cat

from derain.errors import InputError
from derain.evaluation.counts import SCORES, Counts, mean_over_scans
from derain.evaluation.rain_counts import (
    RANGE_EDGES,
    ClassCounts,
    band_names,
    check_classes,
    unknown_class,
)
from derain.scan import Scan


class RainMetrics(Metric):
    """Precision, recall, F1 and IoU of rain, with exact counts by scan, class and range.

    Counts are int64 and add up across processes. The methods that return counts gather them from
    every process, as ``compute`` does: where there are several processes, each must call them.

    Args:
        classes: Name of every semantic class, by id.
        rain: Ids of the classes that count as rain.
        range_edges: Where the range bands start, metres, rising from 0; the last band is open.
        unknown: Ids of the classes that are not counted, for nobody knows whether they are rain.

    Raises:
        InputError: Two classes of one name, rain that is no known class, or edges that do not rise
            from 0.
    """

    is_differentiable = False
    higher_is_better = True
    full_state_update = False

    ids: Tensor
    is_rain: Tensor
    unknown: Tensor
    cells: Tensor
    scan_counts: list[Tensor]

    def __init__(
        self,
        classes: Mapping[int, str],
        rain: Collection[int],
        range_edges: Sequence[float] = RANGE_EDGES,
        unknown: Collection[int] = (),
    ) -> None:
        super().__init__()
        classes = {id_: name for id_, name in classes.items() if id_ not in unknown}
        check_classes(classes, rain, range_edges)
        ids = sorted(classes)
        self.names = [classes[id_] for id_ in ids]
        self.range_edges = tuple(range_edges)
        self.register_buffer("ids", torch.tensor(ids), persistent=False)
        self.register_buffer("is_rain", torch.tensor([i in rain for i in ids]), persistent=False)
        self.register_buffer("unknown", torch.tensor([*unknown], dtype=torch.int64), False)

        # Points by class, range band and whether they were called rain.
        cells = torch.zeros(len(ids), len(range_edges), 2, dtype=torch.int64)
        self.add_state("cells", cells, dist_reduce_fx="sum")
        self.add_state("scan_counts", [], dist_reduce_fx="cat")
        self.reset()

    def reset(self) -> None:
        """Forgets every scan."""
        super().reset()
        # A process that saw no scan still has rows of the right width and type to join.
        self.scan_counts.append(self.cells.new_empty(0, 4))

    def update(
        self, predicted: Tensor, label: Tensor, range: Tensor, scan: Tensor, scans: int
    ) -> None:
        """Counts the points of a batch of scans.

        Args:
            predicted: True for the points called rain, bool (N,).
            label: Semantic class ids, int64 (N,).
            range: Distance from the sensor, float (N,), metres. What is not finite belongs to the
                last band.
            scan: Which scan of the batch a point belongs to, 0 … ``scans`` − 1, int64 (N,).
            scans: Scans in the batch; one without points counts as a scan of zero points.

        Raises:
            InputError: A label that is no class.
            RuntimeError: A scan number out of its bounds.
            IndexError: Tensors of different lengths.
        """
        known = ~torch.isin(label, self.unknown)
        predicted, label, range, scan = predicted[known], label[known], range[known], scan[known]
        row = self._class_rows(label)
        cell = (row * len(self.range_edges) + self._bands(range)) * 2 + predicted
        cells = torch.bincount(cell, minlength=self.cells.numel()).reshape(self.cells.shape)
        # In the order of the fields of Counts.
        outcome = 2 * ~predicted + ~self.is_rain[row]
        outcomes = torch.bincount(4 * scan + outcome, minlength=4 * scans).reshape(scans, 4)

        self.cells += cells
        self.scan_counts.append(outcomes)

    def update_scan(self, scan: Scan, predicted: NDArray[np.bool_]) -> None:
        """Counts the points of one labelled scan.

        Args:
            scan: A scan with labels.
            predicted: True for the points called rain, bool (N,).

        Raises:
            InputError: A scan without labels, or a label that is no class.
        """
        if scan.label is None:
            raise InputError(scan.name, "it has no labels", "Give its label file.")
        self.update(
            predicted=torch.from_numpy(predicted).to(self.device),
            label=torch.from_numpy(scan.label).to(self.device),
            range=torch.from_numpy(scan.range).to(self.device),
            scan=torch.zeros(len(scan), dtype=torch.int64, device=self.device),
            scans=1,
        )

    def compute(self) -> dict[str, Tensor]:
        """Every score over all points, and as the mean over scans (``…_per_scan``).

        Returns:
            float32 scalars by name, NaN where a score is undefined; a mean over scans is over
            those that have the score. Compare like with like: in table II of the REHEARSE-3D paper
            the rows agree with pooled counts, save LiSnowNet's, which fit means over scans.
        """
        pooled, per_scan = self._pooled(), self._per_scan()
        scores = {score: getattr(pooled, score) for score in SCORES}
        scores |= {f"{score}_per_scan": mean_over_scans(per_scan, score) for score in SCORES}
        return {
            name: torch.tensor(score, dtype=torch.float32, device=self.device)
            for name, score in scores.items()
        }

    def pooled(self) -> Counts:
        """Counts over the points of all scans."""
        with self.sync_context():
            return self._pooled()

    def pooled_over(self, ids: Collection[int]) -> Counts:
        """Counts over the points of some classes, such as those of one of several data sets."""
        with self.sync_context():
            table = self.cells.sum(dim=1)
        chosen = torch.isin(self.ids, torch.tensor([*ids], device=self.ids.device))
        return self._counts(table * chosen[:, None])

    def per_scan(self) -> list[Counts]:
        """Counts of each scan, in the order of the updates, process after process."""
        with self.sync_context():
            return self._per_scan()

    def by_class(self) -> dict[str, ClassCounts]:
        """What became of each semantic class, by name."""
        with self.sync_context():
            table = self.cells.sum(dim=1).tolist()
        return {
            name: ClassCounts(kept + called_rain, called_rain, rain)
            for name, rain, (kept, called_rain) in zip(
                self.names, self.is_rain.tolist(), table, strict=True
            )
        }

    def by_range(self) -> dict[str, Counts]:
        """Counts of each range band, by ``band_names``."""
        with self.sync_context():
            tables = self.cells.unbind(dim=1)
        names = band_names(self.range_edges)
        return {name: self._counts(table) for name, table in zip(names, tables, strict=True)}

    def by_class_and_range(self) -> dict[str, list[ClassCounts]]:
        """What became of each semantic class in each of the bands of ``band_names``, by name."""
        with self.sync_context():
            tables = self.cells.tolist()
        return {
            name: [ClassCounts(kept + called_rain, called_rain, rain) for kept, called_rain in row]
            for name, rain, row in zip(self.names, self.is_rain.tolist(), tables, strict=True)
        }

    def _class_rows(self, label: Tensor) -> Tensor:
        row = torch.searchsorted(self.ids, label).clamp(max=len(self.ids) - 1)
        unknown = label[self.ids[row] != label]
        if len(unknown):
            raise unknown_class(int(unknown[0]))
        return row

    def _bands(self, range: Tensor) -> Tensor:
        inner_edges = torch.tensor(self.range_edges[1:], dtype=range.dtype, device=range.device)
        finite_or_far = torch.where(range.isfinite(), range, torch.inf)
        return torch.bucketize(finite_or_far, inner_edges, right=True)

    def _pooled(self) -> Counts:
        return self._counts(self.cells.sum(dim=1))

    def _per_scan(self) -> list[Counts]:
        return [Counts(*row) for row in dim_zero_cat(self.scan_counts).tolist()]

    def _counts(self, table: Tensor) -> Counts:
        """Joins the classes of an int64 (classes, 2) table of points kept and called rain."""
        false_negative, true_positive = table[self.is_rain].sum(dim=0).tolist()
        true_negative, false_positive = table[~self.is_rain].sum(dim=0).tolist()
        return Counts(true_positive, false_positive, false_negative, true_negative)
