"""LiSnowNet: learns without a label what a range image would be without snow or rain.

Rain is where the image changes: a network trained to make images sparse, and to change them as
little as that takes, takes out what is small and bright against nothing. LiSnowNet-L1 counts a
change by its size, LiSnowNet-L2 by its square.

Source: M.-Y. Yu, R. Vasudevan, M. Johnson-Roberson, "LiSnowNet: Real-time Snow Removal for LiDAR
Point Clouds", IROS 2022.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar, Self

import numpy as np
import torch
from lightning.pytorch.utilities.types import OptimizerLRScheduler
from torch import Tensor, nn

from derain.cards.card import DataCard
from derain.errors import InputError
from derain.files.documents import Entry
from derain.learning.batch import Batch
from derain.learning.task import EXAMPLE_SCANS
from derain.models.base import DerainingModule
from derain.models.lisnownet.network import LiSnowNetwork
from derain.models.lisnownet.selection_rule import (
    SelectionRule,
    cube_roots,
    denoising_change,
    may_be_rain,
    rain_logits,
)
from derain.models.lisnownet.sparsity import RESIDUALS, sparsity_loss
from derain.models.published import Published
from derain.models.range_module import FITTED, range_view, require_grid
from derain.models.registry import NETWORKS
from derain.scan import Float32s, Scan
from derain.views.range_image import RangeView
from derain.views.view import View


class DeployedLiSnowNet(nn.Module):
    """The network with its selection rule: from a raw range image to logits of its pixels.

    Args:
        network: A trained network.
        rule: Its rule of rain.
    """

    def __init__(self, network: LiSnowNetwork, rule: SelectionRule) -> None:
        super().__init__()
        self.network = network
        self.rule = rule

    def forward(self, image: Tensor, valid: Tensor) -> Tensor:
        """Scores every pixel; arguments and result as for :class:`LiSnowNet`."""
        seen = cube_roots(image, self.rule)
        return rain_logits(image, valid, seen, self.network(seen, valid), self.rule)


@NETWORKS.add("lisnownet")
class LiSnowNet(DerainingModule, Published):
    """Trains LiSnowNet on scans without reading a label; the recipe is the published one.

    Example:
        >>> model = LiSnowNet(grid="rehearse3d", rule={"residual": 0.01})
        >>> model.LEARNS_FROM_LABELS, model.selection.residual
        (False, 0.01)

    Args:
        grid: The range image's grid: ``fitted`` to the training scans, the name of a published
            one, or its bounds.
        back_projection: Name of the back-projection, by which points that lost their pixel to a
            nearer one get a score: ``nearest range``, ``copy`` or ``vote``.
        width: Channels of the features at full size, 8 as published.
        dropout: Share of feature maps dropped in training.
        alpha: Weight of sparsity against the residual: it weighs 1 - 2^-alpha.
        beta: Share of the wavelet part in sparsity.
        norm: Norm of the residual: ``l1`` as published, or ``l2``.
        learning_rate: Of Adam.
        decay: Factor by which the learning rate falls per epoch.
        rule: Constants of the :class:`SelectionRule` that are stated, by name. Of the others,
            ground and full scale are fitted to the training scans, and the residual, after every
            epoch, to what the network changes in the validation scans, or in twenty of them.
        threshold: A point is rain where its probability is greater.
        spec: Set by derain when it saves a checkpoint; leave it out otherwise.

    Raises:
        InputError: Weights or a norm of the loss, or constants of the rule, that cannot be meant.
    """

    VIEW: ClassVar[type[View]] = RangeView
    RECIPE: ClassVar[tuple[str, ...]] = (
        *DerainingModule.RECIPE,
        *("alpha", "beta", "norm", "dropout"),
    )
    CHANNELS: ClassVar[tuple[str, ...]] = ("range", "z", "intensity")
    # What denoising changed is divided by the rule's residual, some thousandths.
    LOGIT_GAIN: ClassVar[float] = 100.0
    LEARNS_FROM_LABELS: ClassVar[bool] = False
    network: LiSnowNetwork

    def __init__(
        self,
        grid: str | dict[str, Any] = FITTED,
        back_projection: str = "nearest range",
        width: int = 8,
        dropout: float = 0.5,
        alpha: float = 5.5,
        beta: float = 0.5,
        norm: str = "l1",
        learning_rate: float = 1e-3,
        decay: float = 0.95,
        rule: dict[str, float] = {},
        threshold: float = 0.5,
        spec: dict[str, Any] | None = None,
    ) -> None:
        super().__init__(self.CHANNELS)
        if alpha < 0 or not 0 <= beta <= 1:
            raise InputError(
                self.NAME,
                f"alpha {alpha:g} and beta {beta:g} weigh no loss",
                "Give an alpha of at least 0 and a beta from 0 to 1.",
            )
        if norm not in RESIDUALS:
            raise InputError(self.NAME, f"no such norm: '{norm}'", "Available: l1 and l2.")
        self.save_hyperparameters()
        self.network = LiSnowNetwork(width=width, dropout=dropout)
        self.selection = SelectionRule.fitted(rule, [])
        # Images that the rule's residual is fitted to, the same after every epoch of a training.
        self._examples: list[tuple[Tensor, Tensor]] | None = None
        self.adopt(spec)

    @classmethod
    def from_published(
        cls, state_dict: Mapping[str, Tensor], card: DataCard, grid: str | None = None
    ) -> Self:
        """Builds the model from a published state_dict, with or without ``module.`` prefixes.

        Raises:
            InputError: A state_dict of another network, or no grid.
        """
        network = LiSnowNetwork.from_published(state_dict)
        model = cls(grid=require_grid(grid, cls.NAME), width=network.width)
        model.network = network
        model.adopt(model.spec_for(card))
        return model

    def view_for(self, scans: Sequence[Scan]) -> RangeView:
        """The view that the network sees a scan through, its grid fitted if it is not stated."""
        return range_view(self, scans)

    def rule_for(self, scans: Sequence[Scan]) -> dict[str, float]:
        """Constants of the selection rule, fitted to training scans where they are not stated."""
        return SelectionRule.fitted(self.hparams["rule"], scans).as_dict()

    def adopt_rule(self, rule: Entry) -> None:
        """Takes over the selection rule of a Spec.

        Raises:
            InputError: Constants missing, unknown, or that cannot be.
        """
        self.selection = SelectionRule.of(rule)

    def forward(self, image: Tensor, valid: Tensor) -> Tensor:
        """Logits of every pixel, float (B · H · W, 2).

        Args:
            image: Range (m), z (m) and intensity (the data's unit), float (B, 3, H, W).
            valid: Pixels with a return, bool (B, 1, H, W).
        """
        return self.deployed()(image, valid)

    def deployed(self) -> DeployedLiSnowNet:
        """The network as it is exported."""
        return DeployedLiSnowNet(self.network, self.selection)

    def losses(self, batch: Batch) -> tuple[dict[str, Tensor], Tensor]:
        """Loss with its parts, from the images alone, and logits."""
        image, valid = batch.inputs["image"], batch.inputs["valid"]
        seen = cube_roots(image, self.selection)
        denoised = self.network(seen, valid)
        loss = sparsity_loss(
            denoised, seen, valid, *(self.hparams[name] for name in ("alpha", "beta", "norm"))
        )
        logits = rain_logits(image, valid, seen, denoised.detach(), self.selection)
        return loss._asdict(), logits

    def on_fit_start(self) -> None:
        """Drops the images that an earlier training was fitted to."""
        self._examples = None

    def on_validation_epoch_start(self) -> None:
        """Fits the rule's residual, where it is not stated, to what the network changes by now.

        Before anything is scored: the epoch's scores are those of the checkpoint that it leaves.
        """
        super().on_validation_epoch_start()
        training = self.trainer.state.fn == "fit" and not self.trainer.sanity_checking
        if not training or "residual" in self.hparams["rule"]:
            return
        if self._examples is None:
            self._examples = [self._image_of(scan) for scan in self.validation_scans(EXAMPLE_SCANS)]
        if not self._examples:  # batches that were made elsewhere
            return
        with self.trainer.precision_plugin.val_step_context():  # as the batches are scored
            changes = np.concatenate([self._changes(*example) for example in self._examples])
        rule = self.selection.with_residual_of(changes)
        # Several processes go on with one rule, however each has rounded.
        rule = replace(rule, residual=self.trainer.strategy.broadcast(rule.residual))
        self._log_identical({"val/rule_residual": torch.tensor(rule.residual)})
        self.adopt(replace(self.spec, rule=rule.as_dict()))

    def _image_of(self, scan: Scan) -> tuple[Tensor, Tensor]:
        """The input of :meth:`forward` for a scan."""
        inputs = self.spec.make_view()(scan).inputs()
        image, valid = (torch.from_numpy(inputs[name]) for name in ("image", "valid"))
        return image.to(self.device), valid.to(self.device)

    def _changes(self, image: Tensor, valid: Tensor) -> Float32s:
        """Changes by the network at the returns within the rule's limits, float32 (M,)."""
        seen = cube_roots(image, self.selection)
        changes = denoising_change(seen, self.network(seen, valid))
        return changes[valid & may_be_rain(image, self.selection)].cpu().numpy()

    def configure_optimizers(self) -> OptimizerLRScheduler:
        """Adam with a learning rate that falls after every epoch."""
        optimizer = torch.optim.Adam(
            self.parameters(),
            lr=self.hparams["learning_rate"],
            fused=True,  # many small tensors
        )
        schedule = torch.optim.lr_scheduler.ExponentialLR(optimizer, self.hparams["decay"])
        return {"optimizer": optimizer, "lr_scheduler": schedule}
