"""3D-OutDet: two convolutions over each point's nearest neighbours.

Source: A. M. Raisuddin, T. Cortinhal, J. Holmblad, E. E. Aksoy, "3D-OutDet: A Fast and Memory
Efficient Outlier Detector for 3D LiDAR Point Clouds in Adverse Weather", IEEE IV 2024;
sporsho/3D_OutDet (MIT).
"""

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Self

import torch
from lightning.pytorch.utilities.types import OptimizerLRScheduler
from torch import Tensor

from derain.cards.card import DataCard
from derain.errors import InputError
from derain.models.outdet.network import FoldedOutDet, OutDetNetwork
from derain.models.published import Published
from derain.models.registry import NETWORKS
from derain.models.supervised import SupervisedModule
from derain.scan import Scan
from derain.views.neighbours import NeighbourView
from derain.views.view import View


@NETWORKS.add("outdet")
class OutDet(SupervisedModule, Published):
    """Trains 3D-OutDet; the defaults are the published recipe for WADS.

    Example:
        >>> trainer = Trainer(max_epochs=2, logger=False, enable_progress_bar=False)
        >>> data = derain.Folder(".", "wads", train=["scan.bin"], validation=["scan.bin"])
        >>> model = OutDet(neighbours=5)
        >>> trainer.fit(model, data)
        >>> trainer.global_step, model.spec.data
        (2, 'WADS')

    Args:
        neighbours: k, the size of a neighbourhood, the point itself included.
        channels: Input channels besides distances: ``x``, ``y``, ``z``, ``range``,
            ``intensity``, ``radar``, or other columns of the scans, such as ``doppler``.
        learning_rate: Of Adam.
        weight_decay: Of Adam.
        milestones: Epochs after which the learning rate falls.
        decay: Factor by which it falls.
        threshold: A point is rain where its probability is greater.
        candidates: Share of the training scans' rain that must lie within a few bounds (range,
            height, intensity), outside which no point is judged, nor is any rain, such as 0.999.
            As published, None: all are judged.
        balance: Extra weight of the rarer class: 1 by the inverse of its share, as
            published; 0 not at all, as suits labels with errors, whose few points called rain by
            mistake would count for many.
        spec: Set by derain when it saves a checkpoint; leave it out otherwise.

    Source: sporsho/3D_OutDet, train_wads.py.
    """

    VIEW: ClassVar[type[View]] = NeighbourView
    RECIPE: ClassVar[tuple[str, ...]] = (*SupervisedModule.RECIPE, "milestones")
    # As published.
    CHANNELS: ClassVar[tuple[str, ...]] = ("x", "y", "z", "intensity")
    network: OutDetNetwork

    def __init__(
        self,
        neighbours: int = 9,
        channels: tuple[str, ...] = CHANNELS,
        learning_rate: float = 1e-3,
        weight_decay: float = 1e-4,
        milestones: tuple[int, ...] = (30, 40, 45),
        decay: float = 0.1,
        threshold: float = 0.5,
        candidates: float | None = None,
        balance: float = 1.0,
        spec: dict[str, Any] | None = None,
    ) -> None:
        super().__init__(channels)
        self.save_hyperparameters()
        self.network = OutDetNetwork(neighbours, len(channels))
        self.adopt(spec)

    @classmethod
    def from_published(
        cls, state_dict: Mapping[str, Tensor], card: DataCard, grid: str | None = None
    ) -> Self:
        """Builds the model from a published state_dict, with or without ``module.`` prefixes.

        Raises:
            InputError: A state_dict of another network, or a grid, which it does not see through.
        """
        if grid is not None:
            raise InputError("--grid", f"{cls.NAME} sees neighbours, not a grid", "Leave it out.")
        network = OutDetNetwork.from_published(state_dict)
        model = cls(neighbours=len(network.distance_weight))
        model.network = network
        model.adopt(model.spec_for(card))
        return model

    def view_for(self, scans: Sequence[Scan]) -> NeighbourView:
        """The view that the network sees a scan through, whatever the scans."""
        return NeighbourView(self.hparams["neighbours"], self.channels)

    def accepts_view(self, view: View) -> bool:
        """True if the network can take what a Spec's view gives: as many neighbours as it has."""
        return isinstance(view, NeighbourView) and view.neighbours == self.hparams["neighbours"]

    def forward(
        self,
        points: Tensor,
        distances: Tensor,
        neighbours: Tensor,
        candidates: Tensor | None = None,
    ) -> Tensor:
        """Logits, float (J, 2), of raw points; arguments as for :class:`FoldedOutDet`."""
        normalised = (points - self.mean) / self.std
        return self.network(normalised, distances, neighbours, candidates)

    def deployed(self) -> FoldedOutDet:
        """The network as it is exported, in fewer steps."""
        return FoldedOutDet(self.network, self.mean, self.std)

    def configure_optimizers(self) -> OptimizerLRScheduler:
        """Adam with a learning rate that falls in steps."""
        optimizer = torch.optim.Adam(
            self.parameters(),
            lr=self.hparams["learning_rate"],
            weight_decay=self.hparams["weight_decay"],
        )
        schedule = torch.optim.lr_scheduler.MultiStepLR(
            optimizer, list(self.hparams["milestones"]), self.hparams["decay"]
        )
        return {"optimizer": optimizer, "lr_scheduler": schedule}
