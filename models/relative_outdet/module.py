"""3D-OutDet with relative inputs, none of which differs between sensors.

3D-OutDet is given places and intensities, by which it knows the sensor that it was trained on, and
on another one it finds nothing. This variant of our own is given where neighbours are, in steps of
the sensor's beams, and range.

Source: A. M. Raisuddin, T. Cortinhal, J. Holmblad, E. E. Aksoy, "3D-OutDet: A Fast and Memory
Efficient Outlier Detector for 3D LiDAR Point Clouds in Adverse Weather", IEEE IV 2024, for two
convolutions over nearest neighbours.
"""

from collections.abc import Iterator, Sequence
from typing import Any, ClassVar

import torch
from lightning.pytorch.utilities.types import OptimizerLRScheduler
from torch import Tensor

from derain.errors import InputError
from derain.learning.batch import Batch
from derain.models.registry import NETWORKS
from derain.models.relative_outdet.network import STEP_NEIGHBOUR, RelativeOutDetNetwork
from derain.models.supervised import SupervisedModule, one_cycle
from derain.scan import Scan
from derain.views.neighbours import NeighbourView
from derain.views.view import View


@NETWORKS.add("relative_outdet")
class RelativeOutDet(SupervisedModule):
    """Trains 3D-OutDet made relative.

    Example:
        >>> trainer = Trainer(max_epochs=2, logger=False, enable_progress_bar=False)
        >>> data = derain.Folder(".", "wads", train=["scan.bin"], validation=["scan.bin"])
        >>> model = RelativeOutDet(neighbours=5)
        >>> trainer.fit(model, data)
        >>> model.spec.channels
        ('x', 'y', 'z')

    Args:
        neighbours: k, the size of a neighbourhood, the point itself included; at least 4.
        width: Features of a point.
        of_neighbour: Features of each neighbour, of where it is.
        opinion: Features that a point passes to the points that it is a neighbour of.
        context: Features of what a scan holds at some range; 0 leaves that out.
        learning_rate: Of AdamW, where it is highest.
        weight_decay: Of AdamW.
        threshold: A point is rain where its probability is greater.
        balance: Extra weight of the rarer class: 0 not at all, so that a point wrongly
            called rain counts for no less than one that is missed; 1 by the inverse of its share.
        spec: Set by derain when it saves a checkpoint; leave it out otherwise.
    """

    VIEW: ClassVar[type[View]] = NeighbourView
    # What the view gives it of a point; the network takes from it what does not differ.
    CHANNELS: ClassVar[tuple[str, ...]] = ("x", "y", "z")
    network: RelativeOutDetNetwork

    def __init__(
        self,
        neighbours: int = 9,
        width: int = 32,
        of_neighbour: int = 8,
        opinion: int = 12,
        context: int = 16,
        learning_rate: float = 5e-3,
        weight_decay: float = 1e-4,
        threshold: float = 0.5,
        balance: float = 0.0,
        spec: dict[str, Any] | None = None,
    ) -> None:
        super().__init__(self.CHANNELS)
        if neighbours <= STEP_NEIGHBOUR:
            remedy = f"Give {STEP_NEIGHBOUR + 1} or more."
            raise InputError("neighbours", f"{neighbours} are too few", remedy)
        self.save_hyperparameters()
        self.network = RelativeOutDetNetwork(neighbours, width, of_neighbour, opinion, context)
        self.adopt(spec)

    def view_for(self, scans: Sequence[Scan]) -> NeighbourView:
        """The view that the network sees a scan through, whatever the scans."""
        return NeighbourView(self.hparams["neighbours"], self.channels)

    def accepts_view(self, view: View) -> bool:
        """True if the network can take what a Spec's view gives: all points, and its neighbours."""
        return (
            isinstance(view, NeighbourView)
            and view.neighbours == self.hparams["neighbours"]
            and view.candidates is None
        )

    def forward(self, points: Tensor, distances: Tensor, neighbours: Tensor) -> Tensor:
        """Logits, float (M, 2), of one scan; arguments as for :class:`RelativeOutDetNetwork`."""
        return self.network(points, distances, neighbours)

    def logits_of(self, batch: Batch) -> Tensor:
        """Logits of every cell, float (M, 2), scan by scan: each has a context of its own."""
        return torch.cat([self(*scan) for scan in _scans_of(batch)])

    def deployed(self) -> RelativeOutDetNetwork:
        """The network as it is exported."""
        return self.network

    def configure_optimizers(self) -> OptimizerLRScheduler:
        """AdamW with a learning rate that rises and falls once in the whole training."""
        return one_cycle(self)


def _scans_of(batch: Batch) -> Iterator[tuple[Tensor, Tensor, Tensor]]:
    """Points, distances and neighbours of each scan of a batch."""
    parts = [batch.split(batch.inputs[name]) for name in ("points", "distances", "neighbours")]
    begin = 0
    for points, distances, neighbours in zip(*parts, strict=True):
        yield points, distances, neighbours - begin
        begin += len(points)
