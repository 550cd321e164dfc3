"""Means of losses over the scans that they were measured on."""

import math
from collections.abc import Mapping

import torch
from torch import Tensor
from torchmetrics import Metric
from torchmetrics.utilities import dim_zero_cat


class MeanLosses(Metric):
    """Means of the losses of batches, weighted by the number of scans in each.

    They are the same to the bit in whatever order batches come and in whichever process each is.
    """

    full_state_update = False
    rows: list[Tensor]

    def __init__(self) -> None:
        super().__init__()
        self.names: tuple[str, ...] = ()
        self.add_state("rows", [], dist_reduce_fx="cat")

    def update(self, losses: Mapping[str, Tensor], scans: int) -> None:
        """Takes in the losses of a batch.

        Args:
            losses: Scalars by name, the same names at every call and in every process.
            scans: Number of scans of the batch that count. A batch with none does not change the
                means; a process that has no other learns the names of the losses from it.
        """
        self.names = tuple(losses)
        row = torch.stack([loss.detach().float() for loss in losses.values()])
        self.rows.append(torch.cat([row, row.new_tensor([scans])])[None])

    def compute(self) -> dict[str, Tensor]:
        """The means, float32 scalars by name; NaN where no scan counted."""
        rows = [(values, scans) for *values, scans in dim_zero_cat(self.rows).tolist() if scans]
        total = math.fsum(scans for _, scans in rows)
        means = {}
        for column, name in enumerate(self.names):
            # fsum rounds once, whatever the order.
            weighted = math.fsum(values[column] * scans for values, scans in rows)
            mean = weighted / total if rows else math.nan
            means[name] = torch.tensor(mean, dtype=torch.float32, device=self.device)
        return means
