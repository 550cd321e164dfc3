"""Rain counts as a metric of torchmetrics, which adds them up across the processes of a run."""

from dataclasses import astuple

import torch
from torch import Tensor
from torchmetrics import Metric
from torchmetrics.utilities import dim_zero_cat

from derain.cards.card import DataCard
from derain.evaluation.counts import SCORES, Counts, RainCounts, mean_over_scans
from derain.scan import Bools, Scan


class RainMetrics(Metric):
    """Precision, recall, F1 and IoU of rain, from exact counts by scan, class and range.

    Args:
        card: Data card of the scans. Points of a class that it calls unknown are left out.
    """

    full_state_update = False

    cells: Tensor
    per_scan: list[Tensor]

    def __init__(self, card: DataCard) -> None:
        super().__init__()
        self.card = card
        cells = torch.from_numpy(RainCounts(card).cells)
        self.add_state("cells", cells, dist_reduce_fx="sum")
        self.add_state("per_scan", [], dist_reduce_fx="cat")
        self.reset()

    def reset(self) -> None:
        """Forgets every scan."""
        super().reset()
        # A process that saw no scan still needs a tensor of the right width and type to gather.
        self.per_scan.append(self.cells.new_empty(0, 4))

    def update(self, scan: Scan, called_rain: Bools) -> None:
        """Counts the points of one labelled scan.

        Args:
            scan: A scan of N points, with labels.
            called_rain: True for the points called rain, bool (N,).

        Raises:
            InputError: A scan without labels, or a label that is no class.
        """
        counts = RainCounts(self.card)
        counts.add(scan, called_rain)
        self.cells += torch.from_numpy(counts.cells).to(self.device)
        self.per_scan.append(self.cells.new_tensor([astuple(counts.pooled)]))

    def compute(self) -> dict[str, Tensor]:
        """Every score over all points, and as the mean over scans (``…_per_scan``).

        Returns:
            float32 scalars by name, NaN where a score is undefined; a mean over scans is over
            those that have the score. Compare like with like: in table II of the REHEARSE-3D paper
            the rows agree with pooled counts, save LiSnowNet's, which fit means over scans.
        """
        counts = self._counts()
        pooled, per_scan = counts.pooled, counts.per_scan
        scores = {score: getattr(pooled, score) for score in SCORES}
        scores |= {f"{score}_per_scan": mean_over_scans(per_scan, score) for score in SCORES}
        return {
            name: torch.tensor(score, dtype=torch.float32, device=self.device)
            for name, score in scores.items()
        }

    def counts(self) -> RainCounts:
        """The counts of all processes, each of which must call this; scans process by process."""
        with self.sync_context():
            return self._counts()

    def _counts(self) -> RainCounts:
        counts = RainCounts(self.card)
        counts.cells = self.cells.cpu().numpy().copy()
        counts.per_scan = [Counts(*row) for row in dim_zero_cat(self.per_scan).tolist()]
        return counts
