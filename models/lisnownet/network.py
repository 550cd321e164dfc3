"""The network of LiSnowNet: a U-Net whose halving and doubling are Haar transforms.

Source: M.-Y. Yu, R. Vasudevan, M. Johnson-Roberson, "LiSnowNet: Real-time Snow Removal for LiDAR
Point Clouds", IROS 2022.
"""

from collections.abc import Mapping
from functools import partial
from itertools import pairwise
from typing import Self

import torch
from torch import Tensor, nn
from torch.nn import functional

from derain.errors import InputError
from derain.learning.losses import at_least_float32
from derain.models.layers.batch_norm import PixelBatchNorm
from derain.models.layers.padding import pad_around, pad_to_multiple
from derain.models.published import network_of, published_tensors

HALVINGS = 4

# Channels of an image: range and intensity.
CHANNELS = 2

# What the parts of our parameters' names are called in the published state_dict.
PUBLISHED_WORDS = {
    "encoder.": "enc",
    "decoder.": "dec",
    ".path.": ".main_block.",
    ".convolution.": ".conv.",
    ".norm.": ".bn.",
}


class NormalisedConvolution(nn.Module):
    """A convolution that keeps the image's size, then BatchNorm.

    Args:
        inputs: Channels that come in.
        outputs: Channels that go out.
        size: Height and width of the kernel, odd.
    """

    def __init__(self, inputs: int, outputs: int, size: int) -> None:
        super().__init__()
        self.margin = size // 2
        self.convolution = nn.Conv2d(inputs, outputs, size, bias=False)
        self.norm = PixelBatchNorm(outputs)

    def forward(self, features: Tensor) -> Tensor:
        """Maps (B, inputs, H, W) to (B, outputs, H, W)."""
        if self.margin:
            features = pad_around(features, self.margin)
        return self.norm(self.convolution(features))


class ResidualBlock(nn.Module):
    """Two convolutions with a shortcut past them.

    Args:
        inputs: Channels that come in.
        outputs: Channels that go out.
        dropout: Share of channels dropped between the convolutions in training.
    """

    def __init__(self, inputs: int, outputs: int, dropout: float) -> None:
        super().__init__()
        self.path = nn.Sequential(
            NormalisedConvolution(inputs, outputs, size=3),
            nn.ReLU(),
            nn.Dropout2d(dropout),
            NormalisedConvolution(outputs, outputs, size=3),
        )
        self.shortcut = (
            nn.Identity() if inputs == outputs else NormalisedConvolution(inputs, outputs, size=1)
        )

    def forward(self, features: Tensor) -> Tensor:
        """Maps (B, inputs, H, W) to (B, outputs, H, W)."""
        return functional.relu(self.path(features) + self.shortcut(features))


class Haar(nn.Module):
    """Halves the image and has four times the channels."""

    def forward(self, features: Tensor) -> Tensor:
        """Maps (B, channels, H, W) to (B, 4 channels, H / 2, W / 2)."""
        return haar(features)


class InverseHaar(nn.Module):
    """Doubles the image and has a quarter of the channels."""

    def forward(self, features: Tensor) -> Tensor:
        """Maps (B, 4 channels, H, W) to (B, channels, 2 H, 2 W)."""
        return inverse_haar(features)


class LiSnowNetwork(nn.Module):
    """The network as published, from a range image with holes to a denoised one without.

    Example:
        >>> network = LiSnowNetwork(width=4).eval()
        >>> valid = torch.ones(1, 1, 32, 128, dtype=torch.bool)
        >>> network(torch.rand(1, 2, 32, 128), valid).shape  # an image of 32 × 128 pixels
        torch.Size([1, 2, 32, 128])

    Args:
        width: Channels of the features at full size; each halving doubles them.
        dropout: Share of channels dropped in each residual block in training.

    Raises:
        InputError: A width below 1.
    """

    def __init__(self, width: int = 8, dropout: float = 0.5) -> None:
        super().__init__()
        if width < 1:
            raise InputError("width", f"{width} is too few", "Give 1 or more.")
        self.width = width
        block = partial(ResidualBlock, dropout=dropout)
        widths = [width * 2**level for level in range(HALVINGS + 1)]
        # Stage by stage from full size to the smallest, in the encoder and in the decoder alike.
        self.encoder = nn.ModuleList(
            [nn.Sequential(block(CHANNELS + 1, width), block(width, width))]
        )
        self.decoder = nn.ModuleList(
            [nn.Sequential(block(width, width), block(width, width), nn.Conv2d(width, CHANNELS, 1))]
        )
        for finer, coarser in pairwise(widths):
            self.encoder.append(
                nn.Sequential(Haar(), block(4 * finer, coarser), block(coarser, coarser))
            )
        for finer, coarser in pairwise(widths[:-1]):
            self.decoder.append(
                nn.Sequential(block(coarser, coarser), block(coarser, 4 * finer), InverseHaar())
            )
        self.decoder.append(
            nn.Sequential(NormalisedConvolution(widths[-1], 4 * widths[-2], size=1), InverseHaar())
        )

    @classmethod
    def from_published(cls, state_dict: Mapping[str, Tensor]) -> Self:
        """Builds the network from a published state_dict, with or without ``module.`` prefixes.

        Raises:
            InputError: A state_dict of another network.
        """
        keys = {name: published_key(name) for name in cls().state_dict()}
        tensors = published_tensors(state_dict, keys, "LiSnowNet")
        width = tensors["decoder.0.0.path.0.norm.bias"].numel()
        return network_of(lambda: cls(width), tensors, "LiSnowNet")

    def forward(self, image: Tensor, valid: Tensor) -> Tensor:
        """Denoises range images.

        Sides that are no multiples of 16 are continued with empty pixels, below and on the right,
        which are filled like all others, and cut off in the end.

        Args:
            image: Cube roots of range in metres and of intensity in 0..1, float (B, 2, H, W). What
                empty pixels hold does not matter.
            valid: True for pixels with a return, bool (B, 1, H, W).

        Returns:
            The image as it would be without snow or rain, in the same units, a value in every
            pixel, float32 (B, 2, H, W).
        """
        height, width = image.shape[-2:]
        image = pad_to_multiple(image, 2**HALVINGS, 0)
        valid = pad_to_multiple(valid, 2**HALVINGS, False)
        filled = fill_holes(image, valid)
        seen = torch.cat([filled, valid.to(filled)], dim=1)
        skips, features = [], seen
        for stage in self.encoder:
            features = stage(features)
            skips.append(features)
        features = self.decoder[HALVINGS](features)
        for level in reversed(range(HALVINGS)):
            features = self.decoder[level](features + skips[level])
        if self.training:
            features = torch.where(varies(seen), features, features.detach())
        return (filled + features)[..., :height, :width]


def varies(image: Tensor) -> Tensor:
    """True for images that are more than one value throughout, as far as bfloat16 can tell.

    Others teach nothing: where nothing varies, each BatchNorm divides by the root of its ε alone,
    which multiplies the gradient by 300, layer after layer, beyond all numbers.

    Args:
        image: float (B, channels, H, W).

    Returns:
        bool (B, 1, 1, 1).
    """
    least, greatest = image.amin(dim=(2, 3), keepdim=True), image.amax(dim=(2, 3), keepdim=True)
    noticeable = torch.finfo(torch.bfloat16).eps * greatest.abs()
    return (greatest - least > noticeable).any(dim=1, keepdim=True)


def published_key(name: str) -> str:
    """The key of one of our parameters in the published state_dict."""
    for ours, published in PUBLISHED_WORDS.items():
        name = name.replace(ours, published)
    return name


def haar(image: Tensor) -> Tensor:
    """One level of the two-dimensional Haar transform of images.

    Each 2 × 2 block of pixels, read as (top left, top right, bottom left, bottom right), is
    multiplied by an orthonormal basis, which is symmetric and so its own inverse. Energy is kept.

    Slices and sums are as fast in onnxruntime as strided convolutions or pixel shuffles.

    Args:
        image: float (B, C, H, W), H and W even.

    Returns:
        float (B, 4 C, H / 2, W / 2), band by band: the averages (times 2) of all channels, then
        their details from top to bottom, from left to right, and along the diagonal.

    Source: A. Haar, 1910; the order of pixels and bands is that of LiSnowNet.
    """
    return _times_basis(
        image[..., ::2, ::2], image[..., ::2, 1::2], image[..., 1::2, ::2], image[..., 1::2, 1::2]
    )


def inverse_haar(bands: Tensor) -> Tensor:
    """Undoes :func:`haar`.

    Args:
        bands: float (B, 4 C, H, W), ordered as :func:`haar` does.

    Returns:
        float (B, C, 2 H, 2 W).
    """
    top_left, top_right, bottom_left, bottom_right = _times_basis(*bands.chunk(4, dim=1)).chunk(
        4, dim=1
    )
    top = torch.stack([top_left, top_right], dim=-1).flatten(-2)
    bottom = torch.stack([bottom_left, bottom_right], dim=-1).flatten(-2)
    return torch.stack([top, bottom], dim=-2).flatten(-3, -2)


def _times_basis(a: Tensor, b: Tensor, c: Tensor, d: Tensor) -> Tensor:
    return torch.cat([a + b + c + d, a + b - c - d, a - b + c - d, a - b - c + d], dim=1) / 2


def fill_holes(image: Tensor, valid: Tensor) -> Tensor:
    """Gives every empty pixel a value that suits its surroundings; valid pixels keep theirs.

    A pixel beside valid ones takes the greatest of them; any other takes its row's mean plus one
    standard deviation. Where the image bulges, edges are sharpened, and all is smoothed.

    The published formulas hold wherever they are defined. Where they are 0 / 0, in a row without
    any value to take a mean of, that of the whole image stands in, and an image without a valid
    pixel is 0. Values and gradients are finite for the cube root of every finite float32, and
    computed in float32 or wider, under autocast too.

    Args:
        image: float (B, channels, H, W). Values where nothing is valid are never looked at.
        valid: True for pixels with a return, bool (B, 1, H, W).

    Returns:
        float32 or wider, (B, channels, H, W).
    """
    image = at_least_float32(image)
    nothing = torch.finfo(image.dtype).min
    greatest = functional.max_pool2d(pad_around(torch.where(valid, image, nothing), 1), 3, stride=1)
    known = greatest[:, :1] > nothing
    dense = torch.where(valid, image, greatest)
    dense = torch.where(known, dense, _row_level(dense, known))
    sharpened = dense + functional.relu(_laplacian(dense))
    smoothed = functional.avg_pool2d(pad_around(sharpened, 2), 5, stride=1)
    return torch.where(valid, image, smoothed)


def _row_level(image: Tensor, known: Tensor) -> Tensor:
    """Level of each row's known pixels, or of the image's where the row has none."""
    row = _level(image, known, (-1,))
    whole = _level(image, known, (-2, -1))
    return torch.where(known.any(dim=-1, keepdim=True), row, whole)


def _level(image: Tensor, known: Tensor, dim: tuple[int, ...]) -> Tensor:
    """Mean plus standard deviation of the known pixels; 0 where there are none."""
    count = known.sum(dim, keepdim=True, dtype=image.dtype).clamp(min=1)
    mean = torch.where(known, image, 0).sum(dim, keepdim=True) / count
    deviation = torch.where(known, image - mean, 0)
    # The norm's gradient is 0 at 0, where that of the variance's square root is infinite.
    return mean + torch.linalg.vector_norm(deviation, dim=dim, keepdim=True) / count.sqrt()


def _laplacian(image: Tensor) -> Tensor:
    """Mean of a pixel's eight neighbours less the pixel itself."""
    return (functional.avg_pool2d(pad_around(image, 1), 3, stride=1) - image) * 9 / 8
