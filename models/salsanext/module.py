"""SalsaNext: a range image in, a class for every pixel out; here, rain or not.

Source: T. Cortinhal, G. Tzelepis, E. E. Aksoy, "SalsaNext: Fast, Uncertainty-aware Semantic
Segmentation of LiDAR Point Clouds for Autonomous Driving", ISVC 2020; TiagoCortinhal/SalsaNext
(MIT), salsanext.yml, trainer.py, warmupLR.py.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Self

import torch
from lightning.pytorch.utilities.types import OptimizerLRScheduler
from torch import Tensor, nn

from derain.cards.card import DataCard
from derain.errors import InputError
from derain.learning.losses import SegmentationLoss, at_least_float32, segmentation_loss
from derain.models.published import Published
from derain.models.range_module import FITTED, per_pixel, range_view, require_grid
from derain.models.registry import NETWORKS
from derain.models.salsanext.network import SalsaNextNetwork
from derain.models.supervised import SupervisedModule
from derain.scan import Scan
from derain.views.range_image import RangeView
from derain.views.view import View


class DeployedSalsaNext(nn.Module):
    """The network with its normalisation: from a raw range image to logits of its pixels.

    Args:
        network: From normalised images, 0 where nothing returned, to logits (B, 2, H, W).
        mean: Mean of each input channel, float (C,).
        std: Standard deviation of each input channel, float (C,).
    """

    mean: Tensor
    std: Tensor

    def __init__(self, network: nn.Module, mean: Tensor, std: Tensor) -> None:
        super().__init__()
        self.network = network
        self.register_buffer("mean", mean)
        self.register_buffer("std", std)

    def forward(self, image: Tensor, valid: Tensor) -> Tensor:
        """Logits of "not rain" and "rain" of every pixel, float (B · H · W, 2), row by row.

        Args:
            image: Raw channels in the units of the Spec, float (B, C, H, W).
            valid: Pixels with a return, bool (B, 1, H, W).
        """
        normalised = (image - self.mean[:, None, None]) / self.std[:, None, None]
        return per_pixel(self.network(torch.where(valid, normalised, 0.0)))


class SalsaNextModule(SupervisedModule):
    """Trains a network on range images as SalsaNext was; the optimiser and its schedule are so too.

    Args:
        grid: The range image's grid: ``fitted`` to the training scans, the name of a published
            one, or its bounds.
        back_projection: Name of the back-projection, by which points that lost their pixel to a
            nearer one get a score: ``nearest range``, ``copy`` or ``vote``.
        channels: Input channels: ``range``, ``x``, ``y``, ``z``, ``intensity``, ``radar``,
            or other columns of the scans, such as ``doppler``.
        width: Channels of the first layers, 32 as published; all others are multiples of it.
        dropout: Share of feature maps dropped in training.
        learning_rate: Of stochastic gradient descent, after the warm-up.
        momentum: Of stochastic gradient descent.
        weight_decay: Of stochastic gradient descent.
        warm_up: Epochs in which the learning rate rises from 0.
        decay: Factor by which it falls per epoch after that, a little at every step.
        published_loss: Train as published: empty pixels count as background, and the Lovász loss
            sees rain pixels only, so that it has no false positives.
        threshold: A point is rain where its probability is greater.
        candidates: Share of the training scans' rain that must lie within a few bounds (range,
            height, intensity), outside which nothing is learnt from or called rain; None for none.
        balance: Extra weight of the rarer class: 1 by the inverse of its share, as
            published; 0 not at all, as suits labels with errors, whose few points called rain by
            mistake would count for many.
        spec: Set by derain when it saves a checkpoint; leave it out otherwise.

    Attributes:
        NETWORK: Kind of its network, from normalised range images (B, channels, H, W) to logits
            (B, 2, H, W).

    Source: TiagoCortinhal/SalsaNext, salsanext.yml, trainer.py, warmupLR.py.
    """

    VIEW: ClassVar[type[View]] = RangeView
    RECIPE: ClassVar[tuple[str, ...]] = (
        *SupervisedModule.RECIPE,
        *("momentum", "warm_up", "published_loss", "dropout"),
    )
    CHANNELS: ClassVar[tuple[str, ...]] = ("range", "x", "y", "z", "intensity")
    NETWORK: ClassVar[type[nn.Module]]

    def __init__(
        self,
        grid: str | dict[str, Any] = FITTED,
        back_projection: str = "nearest range",
        channels: tuple[str, ...] = CHANNELS,
        width: int = 32,
        dropout: float = 0.2,
        learning_rate: float = 0.01,
        momentum: float = 0.9,
        weight_decay: float = 1e-4,
        warm_up: float = 1.0,
        decay: float = 0.99,
        published_loss: bool = False,
        threshold: float = 0.5,
        candidates: float | None = None,
        balance: float = 1.0,
        spec: dict[str, Any] | None = None,
    ) -> None:
        super().__init__(channels)
        self.save_hyperparameters()
        self.network = self.NETWORK(len(channels), width, dropout=dropout)
        self.adopt(spec)

    def view_for(self, scans: Sequence[Scan]) -> RangeView:
        """The view that the network sees a scan through, its grid fitted if it is not stated."""
        return range_view(self, scans)

    def forward(self, image: Tensor, valid: Tensor) -> Tensor:
        """Logits of every pixel, float (B · H · W, 2), as :class:`DeployedSalsaNext` gives them."""
        if self.training:
            # The order that oneDNN's convolutions take, and most of all their gradients.
            image = image.contiguous(memory_format=torch.channels_last)
        return DeployedSalsaNext(self.network, self.mean, self.std)(image, valid)

    def deployed(self) -> DeployedSalsaNext:
        """The network as it is exported."""
        return DeployedSalsaNext(self.network, self.mean, self.std)

    def segmentation_loss(self, logits: Tensor, target: Tensor) -> SegmentationLoss:
        """Weighted cross-entropy and Lovász-softmax, over pixels with a return or as published."""
        if not self.hparams["published_loss"]:
            return super().segmentation_loss(logits, target)
        rain = target == 1
        cross_entropy = segmentation_loss(logits, rain.long(), self.class_weight).cross_entropy
        # Lovász-softmax over the pixels of rain alone, which are of one class.
        missed = 1 - at_least_float32(logits)[rain].softmax(dim=1)[:, 1]
        lovasz = missed.sum() / max(len(missed), 1)
        return SegmentationLoss(cross_entropy + lovasz, cross_entropy, lovasz)

    def configure_optimizers(self) -> OptimizerLRScheduler:
        """Stochastic gradient descent with a warm-up and a learning rate that falls at every step.

        Source: TiagoCortinhal/SalsaNext, warmupLR.py.
        """
        optimizer = torch.optim.SGD(
            self.parameters(),
            lr=self.hparams["learning_rate"],
            momentum=self.hparams["momentum"],
            weight_decay=self.hparams["weight_decay"],
        )
        self.trainer.fit_loop.setup_data()  # so that the number of batches is known
        # Of the optimiser, as the schedule counts them; the last of an epoch takes what is left.
        steps = math.ceil(self.trainer.num_training_batches / self.trainer.accumulate_grad_batches)
        warm_up = self.hparams["warm_up"] * steps

        def factor(step: int) -> float:
            if step < warm_up:
                return (step + 1) / warm_up
            return float(self.hparams["decay"] ** ((step - warm_up) / steps))

        schedule = torch.optim.lr_scheduler.LambdaLR(optimizer, factor)
        return {"optimizer": optimizer, "lr_scheduler": {"scheduler": schedule, "interval": "step"}}


@NETWORKS.add("salsanext")
class SalsaNext(SalsaNextModule, Published):
    """SalsaNext as published, trained on rain.

    Example:
        >>> model = SalsaNext(grid="rehearse3d", width=8)
        >>> model.network.width, model.channels
        (8, ('range', 'x', 'y', 'z', 'intensity'))
    """

    NETWORK: ClassVar[type[nn.Module]] = SalsaNextNetwork
    network: SalsaNextNetwork

    @classmethod
    def from_published(
        cls, state_dict: Mapping[str, Tensor], card: DataCard, grid: str | None = None
    ) -> Self:
        """Builds the model from a published state_dict, with or without ``module.`` prefixes.

        Raises:
            InputError: A state_dict of another network or of more than two classes, or no grid.
        """
        network = SalsaNextNetwork.from_published(state_dict)
        if (network.channels, network.classes) != (len(cls.CHANNELS), 2):
            raise InputError(
                cls.NAME,
                f"the weights are for {network.classes} classes and {network.channels} channels",
                f"Give weights for two classes, rain and the rest, from {', '.join(cls.CHANNELS)}.",
            )
        model = cls(grid=require_grid(grid, cls.NAME), width=network.width)
        model.network = network
        model.adopt(model.spec_for(card))
        return model
