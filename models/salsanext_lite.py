"""A variant of SalsaNext of our own, made for what a CPU computes well.

It keeps the plan of SalsaNext: context at full resolution, blocks of growing reach on an image that
is halved four times and doubled again. What differs is what costs time and finds no rain:

- Convolution, BatchNorm, ReLU, in this order. So every BatchNorm folds into its convolution, and
  in eight bits the ReLU is no more than where its numbers end.
- The layers of a block are half as wide as what they are joined into; the join sees what the block
  sees, which stands in for the shortcut.
- Features are halved by their maximum, and doubled by repeating them behind a 1×1 convolution,
  which onnxruntime does in the layout that it keeps features in; shuffled pixels it has to move.

Source: T. Cortinhal, G. Tzelepis, E. E. Aksoy, "SalsaNext: Fast, Uncertainty-aware Semantic
Segmentation of LiDAR Point Clouds for Autonomous Driving", ISVC 2020, for the plan; Y. Lee et al.,
"An Energy and GPU-Computation Efficient Backbone Network for Real-Time Object Detection", CVPR
Workshops 2019, for joining once what a block and its layers see.
"""

from copy import deepcopy
from functools import partial
from typing import ClassVar

import torch
from torch import Tensor, nn
from torch.nn import functional
from torch.nn.utils.fusion import fuse_conv_bn_eval

from derain.errors import InputError
from derain.models.layers.batch_norm import PixelBatchNorm
from derain.models.registry import NETWORKS
from derain.models.salsanext.module import DeployedSalsaNext, SalsaNextModule
from derain.models.salsanext.network import SalsaNextPlan


class FoldingLayer(nn.Module):
    """Convolution and BatchNorm, which are one convolution once trained; H and W stay.

    Args:
        inputs: Number of input channels.
        outputs: Number of output channels.
        kernel: Side of the kernel in taps.
        dilation: Distance between taps in pixels.
    """

    def __init__(self, inputs: int, outputs: int, kernel: int, dilation: int = 1) -> None:
        super().__init__()
        self.convolution = nn.Conv2d(
            inputs, outputs, kernel, padding="same", dilation=dilation, bias=False
        )
        self.norm: nn.Module = PixelBatchNorm(outputs)

    def forward(self, features: Tensor) -> Tensor:
        """Features, float (B, outputs, H, W), of float (B, inputs, H, W)."""
        return self.norm(self.convolution(features))

    def fold(self) -> None:
        """Makes one convolution of both, that of the running statistics; in evaluation mode."""
        assert isinstance(self.norm, PixelBatchNorm)
        self.convolution = fuse_conv_bn_eval(self.convolution, self.norm)
        self.norm = nn.Identity()


class ResidualContext(nn.Module):
    """Two layers that add what is around a pixel to what is in it."""

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        # What has as many channels already is added as it is.
        self.shortcut = nn.Identity() if inputs == outputs else FoldingLayer(inputs, outputs, 1)
        self.near = FoldingLayer(inputs, outputs, kernel=3)
        self.farther = FoldingLayer(outputs, outputs, kernel=3, dilation=2)

    def forward(self, features: Tensor) -> Tensor:
        """Features, float (B, outputs, H, W), of float (B, inputs, H, W)."""
        around = self.farther(functional.relu(self.near(features)))
        return functional.relu(self.shortcut(features) + around)


class JoinedLayers(nn.Module):
    """Three layers of growing reach, one after the other, joined once with what they began with.

    Args:
        inputs: Number of input channels.
        outputs: Number of output channels.
        layers: Number of channels of each layer; None for half as many as come out.
    """

    def __init__(self, inputs: int, outputs: int, layers: int | None = None) -> None:
        super().__init__()
        layers = outputs // 2 if layers is None else layers
        self.layers = nn.ModuleList(
            [
                FoldingLayer(inputs, layers, kernel=3),
                FoldingLayer(layers, layers, kernel=3, dilation=2),
                FoldingLayer(layers, layers, kernel=2, dilation=2),
            ]
        )
        self.join = FoldingLayer(inputs + 3 * layers, outputs, kernel=1)

    def forward(self, features: Tensor) -> Tensor:
        """Features, float (B, outputs, H, W), of float (B, inputs, H, W)."""
        found = [features]
        for layer in self.layers:
            found.append(functional.relu(layer(found[-1])))
        return functional.relu(self.join(torch.cat(found, dim=1)))


class DoublingBlock(nn.Module):
    """Doubles the image, adds what the encoder found at that size, and looks around."""

    def __init__(self, inputs: int, skipped: int, outputs: int, dropout: float) -> None:
        super().__init__()
        self.narrow = FoldingLayer(inputs, outputs, kernel=1)
        self.skip = FoldingLayer(skipped, outputs, kernel=1)
        self.dropout = nn.Dropout2d(dropout)
        self.layers = JoinedLayers(outputs, outputs, layers=outputs)

    def forward(self, features: Tensor, skip: Tensor) -> Tensor:
        """Features of the doubled image.

        Args:
            features: Features of the smaller image, float (B, inputs, H / 2, W / 2).
            skip: Features of the encoder, float (B, skipped, H, W).

        Returns:
            Features, float (B, outputs, H, W).
        """
        # Narrowed first: a 1×1 convolution of repeated pixels is the repeated 1×1 convolution.
        doubled = functional.interpolate(self.narrow(features), scale_factor=2, mode="nearest")
        joined = self.dropout(functional.relu(doubled + self.skip(skip)))
        return self.dropout(self.layers(joined))


class SalsaNextLiteNetwork(SalsaNextPlan):
    """The network, from normalised range images to logits.

    Example:
        >>> network = SalsaNextLiteNetwork(channels=5, width=4).eval()
        >>> network(torch.rand(1, 5, 32, 128)).shape  # an image of 32 × 128 pixels
        torch.Size([1, 2, 32, 128])

    Args:
        channels: Number of input channels.
        width: Number of features at full resolution; deeper down there are up to eight times as
            many. Multiples of 16 leave no lane of AVX-512 empty, multiples of 8 none of AVX2.
        classes: Number of output channels.
        dropout: Share of the features dropped in training, below full resolution.

    Raises:
        InputError: A width that is not positive.
    """

    CONTEXT = ResidualContext
    BLOCK = JoinedLayers
    DOUBLING = DoublingBlock

    def __init__(
        self, channels: int = 5, width: int = 16, classes: int = 2, dropout: float = 0.2
    ) -> None:
        if width < 1:
            raise InputError("width", f"{width} is not positive", "Give 16, or a multiple of it.")
        super().__init__(channels, width, classes, dropout, partial(nn.MaxPool2d, 2))

    def folded(self) -> "SalsaNextLiteNetwork":
        """A copy in evaluation mode that computes the same without a BatchNorm."""
        network = deepcopy(self).eval()
        for layer in network.modules():
            if isinstance(layer, FoldingLayer):
                layer.fold()
        return network


@NETWORKS.add("salsanext_lite")
class SalsaNextLite(SalsaNextModule):
    """The variant of SalsaNext that folds, trained as SalsaNext is.

    Example:
        >>> model = SalsaNextLite(grid="wads", width=16)
        >>> model.network.width, model.channels
        (16, ('range', 'x', 'y', 'z', 'intensity'))
    """

    # All that it is made of: from the image to the scores nothing leaves the integers.
    INTEGER_OPERATORS: ClassVar[tuple[str, ...]] = (
        "Conv",
        "Relu",
        "Add",
        "Concat",
        "MaxPool",
        "Resize",
    )
    NETWORK: ClassVar[type[nn.Module]] = SalsaNextLiteNetwork
    network: SalsaNextLiteNetwork

    def deployed(self) -> DeployedSalsaNext:
        """The network as it is exported: each BatchNorm folded into its convolution."""
        return DeployedSalsaNext(self.network.folded(), self.mean, self.std)
