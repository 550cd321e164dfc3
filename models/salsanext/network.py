"""The network of SalsaNext: dilated convolutions over a range image that is halved four times.

Source: T. Cortinhal, G. Tzelepis, E. E. Aksoy, "SalsaNext: Fast, Uncertainty-aware Semantic
Segmentation of LiDAR Point Clouds for Autonomous Driving", ISVC 2020; TiagoCortinhal/SalsaNext
(MIT).
"""

from collections.abc import Callable, Mapping
from functools import partial
from itertools import pairwise
from typing import ClassVar, Self

import torch
from torch import Tensor, nn
from torch.nn import functional

from derain.errors import InputError
from derain.models.layers.batch_norm import PixelBatchNorm
from derain.models.layers.padding import pad_to_multiple
from derain.models.published import network_of, published_tensors

# The image is halved four times.
STRIDE = 16

# Slope of every LeakyReLU where its input is negative.
SLOPE = 0.01


def _published_modules() -> dict[str, str]:
    """The place of each of our convolutions and BatchNorms in the published network."""
    blocks = {"context.0": "downCntx", "context.1": "downCntx2", "context.2": "downCntx3"}
    blocks |= {f"encoder.{level}": f"resBlock{level + 1}" for level in range(4)}
    blocks |= {"bottleneck.0": "resBlock5"}
    blocks |= {f"decoder.{level}": f"upBlock{level + 1}" for level in range(4)}
    modules = {"head": "logits"}
    for block, published in blocks.items():
        first = 1
        if not block.startswith("decoder"):  # a shortcut is its block's first convolution
            modules[f"{block}.shortcut"] = f"{published}.conv1"
            first = 2
        for layer in range(2 if block.startswith("context") else 4):
            modules[f"{block}.layers.{layer}.convolution"] = f"{published}.conv{first + layer}"
            modules[f"{block}.layers.{layer}.norm"] = f"{published}.bn{1 + layer}"
    return modules


CONVOLUTION = ("weight", "bias")
NORM = ("weight", "bias", "running_mean", "running_var", "num_batches_tracked")

# Where each of our tensors stands in the published state_dict.
PUBLISHED_KEYS = {
    f"{module}.{tensor}": f"{published}.{tensor}"
    for module, published in _published_modules().items()
    for tensor in (NORM if module.endswith("norm") else CONVOLUTION)
}


class SalsaNextPlan(nn.Module):
    """The path of features from block to block, for any kind of blocks.

    Args:
        channels: Number of input channels.
        width: Number of features at full resolution; deeper down there are up to eight times as
            many.
        classes: Number of output channels.
        dropout: Share of the features dropped in training, below full resolution.
        halving: Makes a layer that halves the image.

    Attributes:
        CONTEXT: Makes a block at full resolution, of numbers of inputs and outputs.
        BLOCK: Makes a block of the encoder or the bottleneck, of the same.
        DOUBLING: Makes a block of the decoder, of numbers of inputs, of the encoder's features of
            its size and of outputs, and of the share of features that it drops.
        channels: As given.
        width: As given.
        classes: As given.
    """

    CONTEXT: ClassVar[type[nn.Module]]
    BLOCK: ClassVar[type[nn.Module]]
    DOUBLING: ClassVar[type[nn.Module]]

    def __init__(
        self,
        channels: int,
        width: int,
        classes: int,
        dropout: float,
        halving: Callable[[], nn.Module],
    ) -> None:
        super().__init__()
        self.channels, self.width, self.classes = channels, width, classes
        encoder = [width * factor for factor in (1, 2, 4, 8, 8)]
        decoder = [width * factor for factor in (8, 4, 4, 2, 1)]
        rates = (0.0, dropout, dropout, dropout)  # from full resolution downwards
        self.context = nn.Sequential(
            *(self.CONTEXT(inputs, width) for inputs in (channels, width, width))
        )
        self.encoder = nn.ModuleList(self.BLOCK(*pair) for pair in pairwise(encoder))
        self.halve = nn.ModuleList(nn.Sequential(nn.Dropout2d(rate), halving()) for rate in rates)
        self.bottleneck = nn.Sequential(self.BLOCK(encoder[-1], decoder[0]), nn.Dropout2d(dropout))
        self.decoder = nn.ModuleList(
            self.DOUBLING(inputs, skipped, outputs, rate)
            for (inputs, outputs), skipped, rate in zip(
                pairwise(decoder), reversed(encoder[1:]), reversed(rates), strict=True
            )
        )
        self.head = nn.Conv2d(width, classes, 1)

    def forward(self, image: Tensor) -> Tensor:
        """Scores every pixel.

        Args:
            image: Normalised range image, 0 in every channel where there is no return, float
                (B, channels, H, W). Where a side is no multiple of 16, it counts as continued by
                empty pixels at the bottom and on the right.

        Returns:
            Logits, float (B, classes, H, W).
        """
        height, width = image.shape[-2:]
        features = self.context(pad_to_multiple(image, STRIDE, value=0.0))
        skips = []
        for block, halve in zip(self.encoder, self.halve, strict=True):
            skips.append(block(features))
            features = halve(skips[-1])
        features = self.bottleneck(features)
        for block, skip in zip(self.decoder, reversed(skips), strict=True):
            features = block(features, skip)
        scores: Tensor = self.head(features)[..., :height, :width]
        return scores


class ConvolutionLayer(nn.Module):
    """Convolution, activation and, as published, only then BatchNorm; H and W stay.

    Args:
        inputs: Number of input channels.
        outputs: Number of output channels.
        kernel: Side of the kernel in taps.
        dilation: Distance between taps in pixels.
    """

    def __init__(self, inputs: int, outputs: int, kernel: int, dilation: int = 1) -> None:
        super().__init__()
        self.convolution = nn.Conv2d(inputs, outputs, kernel, padding="same", dilation=dilation)
        self.norm = PixelBatchNorm(outputs)

    def forward(self, features: Tensor) -> Tensor:
        """Features, float (B, outputs, H, W), of float (B, inputs, H, W)."""
        return self.norm(functional.leaky_relu(self.convolution(features), SLOPE))


class DilatedLayers(nn.ModuleList):
    """Three layers of growing reach, one after the other, and one that joins what they found."""

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__(
            [
                ConvolutionLayer(inputs, outputs, kernel=3),
                ConvolutionLayer(outputs, outputs, kernel=3, dilation=2),
                ConvolutionLayer(outputs, outputs, kernel=2, dilation=2),
                ConvolutionLayer(3 * outputs, outputs, kernel=1),
            ]
        )

    def forward(self, features: Tensor) -> Tensor:
        """Features, float (B, outputs, H, W), of float (B, inputs, H, W)."""
        first, second, third, join = self
        near = first(features)
        farther = second(near)
        return join(torch.cat([near, farther, third(farther)], dim=1))


class ContextBlock(nn.Module):
    """Two layers that add what is around a pixel to what is in it."""

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        self.shortcut = nn.Conv2d(inputs, outputs, 1)
        self.layers = nn.Sequential(
            ConvolutionLayer(outputs, outputs, kernel=3),
            ConvolutionLayer(outputs, outputs, kernel=3, dilation=2),
        )

    def forward(self, features: Tensor) -> Tensor:
        """Features, float (B, outputs, H, W), of float (B, inputs, H, W)."""
        shortcut = functional.leaky_relu(self.shortcut(features), SLOPE)
        return shortcut + self.layers(shortcut)


class DilatedBlock(nn.Module):
    """Dilated layers beside a shortcut."""

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        self.shortcut = nn.Conv2d(inputs, outputs, 1)
        self.layers = DilatedLayers(inputs, outputs)

    def forward(self, features: Tensor) -> Tensor:
        """Features, float (B, outputs, H, W), of float (B, inputs, H, W)."""
        shortcut = functional.leaky_relu(self.shortcut(features), SLOPE)
        return shortcut + self.layers(features)


class DecoderBlock(nn.Module):
    """Doubles the image and joins it with what the encoder found at that size."""

    def __init__(self, inputs: int, skipped: int, outputs: int, dropout: float) -> None:
        super().__init__()
        self.dropout = nn.Dropout2d(dropout)
        self.layers = DilatedLayers(inputs // 4 + skipped, outputs)

    def forward(self, features: Tensor, skip: Tensor) -> Tensor:
        """Features of the doubled image.

        Args:
            features: Features of the smaller image, float (B, inputs, H / 2, W / 2).
            skip: Features of the encoder, float (B, skipped, H, W).

        Returns:
            Features, float (B, outputs, H, W).
        """
        doubled = self.dropout(functional.pixel_shuffle(features, 2))
        joined = self.dropout(torch.cat([doubled, skip], dim=1))
        return self.dropout(self.layers(joined))


class SalsaNextNetwork(SalsaNextPlan):
    """The network as published, from normalised range images to logits.

    Example:
        >>> network = SalsaNextNetwork(channels=5, width=4).eval()
        >>> network(torch.rand(1, 5, 32, 128)).shape  # an image of 32 × 128 pixels
        torch.Size([1, 2, 32, 128])

    Args:
        channels: Number of input channels.
        width: Number of features at full resolution, even; deeper down there are up to eight times
            as many. The published network's is 32.
        classes: Number of output channels.
        dropout: Share of the features dropped in training, below full resolution.

    Raises:
        InputError: A width that is not a positive even number.
    """

    CONTEXT = ContextBlock
    BLOCK = DilatedBlock
    DOUBLING = DecoderBlock

    def __init__(
        self, channels: int = 5, width: int = 32, classes: int = 2, dropout: float = 0.2
    ) -> None:
        if width < 2 or width % 2:
            # The last pixel shuffle makes width / 2 features of 2 × width.
            raise InputError(
                "width", f"{width} is not a positive even number", "Give 32, as published, 16 or 8."
            )
        halving = partial(nn.AvgPool2d, 3, stride=2, padding=1)
        super().__init__(channels, width, classes, dropout, halving)

    @classmethod
    def from_published(cls, state_dict: Mapping[str, Tensor]) -> Self:
        """Builds the network from a published state_dict, with or without ``module.`` prefixes.

        Raises:
            InputError: A state_dict of another network.
        """
        tensors = published_tensors(state_dict, PUBLISHED_KEYS, "SalsaNext")
        width = tensors["context.0.shortcut.bias"].numel()
        channels = tensors["context.0.shortcut.weight"].numel() // max(width, 1)
        classes = tensors["head.bias"].numel()
        return network_of(lambda: cls(channels, width, classes), tensors, "SalsaNext")
