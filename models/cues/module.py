"""Cues: what geometry and brightness each know of a point, weighed by one fusion."""

from typing import Any, ClassVar, cast

import torch
from torch import Tensor
from torch.nn import functional

from derain.errors import InputError
from derain.learning.batch import Batch
from derain.models.base import DerainingModule
from derain.models.cues.network import AROUND, CuedNetwork
from derain.models.registry import NETWORKS
from derain.models.relative_outdet.module import RelativeOutDet
from derain.models.relative_outdet.network import (
    RelativeOutDetNetwork,
    both_logits,
    without_carrier,
)
from derain.views.channels import INTENSITY_RANK


@NETWORKS.add("cued_outdet")
class CuedOutDet(RelativeOutDet):
    """Trains the fusion of cues, and the geometry beneath it.

    Geometry is judged by 3D-OutDet made relative, which sees no intensity. What its answers show of
    rain's intensities in that very scan is the second cue, so that no unit, gain or sensor has to
    be known.

    Example:
        >>> trainer = Trainer(max_epochs=2, logger=False, enable_progress_bar=False)
        >>> data = derain.Folder(".", "wads", train=["scan.bin"], validation=["scan.bin"])
        >>> model = CuedOutDet()
        >>> trainer.fit(model, data)
        >>> model.spec.channels
        ('x', 'y', 'z', 'intensity_rank')

    Args:
        neighbours: k, the size of a neighbourhood, the point itself included; at least 9.
        width: Features of a point, as geometry sees it.
        of_neighbour: Features of each neighbour, of where it is.
        opinion: What a point tells those that it is a neighbour of.
        context: Features of what a scan holds at some range; 0 leaves that out.
        fusion: Features of a point in the layers that weigh the cues.
        geometry_share: How quickly geometry learns, as a share of the learning rate; 0 leaves it as
            it is, which asks for a start from a trained model.
        learning_rate: Of AdamW, where it is highest.
        weight_decay: Of AdamW.
        threshold: A point is rain where its probability is greater.
        balance: How far the rarer class counts for more, in geometry: 0 not at all, 1 by the
            inverse of its share.
        spec: Set by derain when it saves a checkpoint; leave it out otherwise.

    Raises:
        InputError: Fewer than 9 neighbours.
    """

    CHANNELS: ClassVar[tuple[str, ...]] = (*RelativeOutDet.CHANNELS, INTENSITY_RANK)
    MERGED: ClassVar[bool] = True
    RECIPE: ClassVar[tuple[str, ...]] = (*RelativeOutDet.RECIPE, "geometry_share")
    network: CuedNetwork  # type: ignore[assignment]

    def __init__(
        self,
        neighbours: int = 9,
        width: int = 32,
        of_neighbour: int = 8,
        opinion: int = 12,
        context: int = 16,
        fusion: int = 48,
        geometry_share: float = 1.0,
        learning_rate: float = 5e-3,
        weight_decay: float = 1e-4,
        threshold: float = 0.5,
        balance: float = 0.0,
        spec: dict[str, Any] | None = None,
    ) -> None:
        super().__init__(neighbours, width, of_neighbour, opinion, context)
        if neighbours <= AROUND:
            raise InputError(
                "neighbours", f"{neighbours} are too few", f"Give {AROUND + 1} or more."
            )
        self.save_hyperparameters()
        geometry = cast(RelativeOutDetNetwork, self.network)
        self.network = CuedNetwork(geometry, fusion)
        self.adopt(spec)

    def begin_from(self, source: DerainingModule) -> None:
        """Takes over the weights of a trained model, or of its geometry from one that has no more.

        Raises:
            InputError: A model of another network.
        """
        if type(source) is RelativeOutDet:
            self.network.geometry.load_state_dict(source.network.state_dict())
        else:
            super().begin_from(source)

    def losses(self, batch: Batch) -> tuple[dict[str, Tensor], Tensor]:
        """Loss of geometry and of the rounds of the fusion, and the logits of the last round."""
        assert batch.target is not None  # the data modules pair these scans with labels
        geometry_learns = self.hparams["geometry_share"] > 0
        seen, answers = [], []
        for points, distances, neighbours in self.scans_of(batch):
            with torch.set_grad_enabled(torch.is_grad_enabled() and geometry_learns):
                rain, far = self.network.geometry.rain_and_range(
                    points[:, :3], distances, neighbours
                )
            given = without_carrier(rain, far).detach()
            seen.append(rain)
            answers.append(
                torch.stack(self.network.fused(given, points, distances, neighbours), dim=1)
            )
        of_rounds = torch.cat(answers)
        target = batch.target[:, None].expand_as(of_rounds).to(of_rounds.dtype)
        fusion = functional.binary_cross_entropy_with_logits(of_rounds, target)
        geometry = self.segmentation_loss(both_logits(torch.cat(seen)), batch.target).total
        loss = fusion + geometry if geometry_learns else fusion
        losses = {"loss": loss, "geometry": geometry, "fusion": fusion}
        return losses, both_logits(of_rounds[:, -1])

    def parameter_groups(self) -> list[dict[str, Any]]:
        """Geometry, which learns more slowly or not at all, and the fusion."""
        rate, share = self.hparams["learning_rate"], self.hparams["geometry_share"]
        fusion = {"params": self.network.rounds.parameters(), "lr": rate}
        if share == 0:
            return [fusion]
        return [fusion, {"params": self.network.geometry.parameters(), "lr": share * rate}]
