"""LiSnowNet's loss, without labels: the image becomes sparse, and stays close to the input.

A range image without snow or rain has few details, so few of its wavelet and Fourier coefficients
differ from 0. All is computed in float32 or wider, and values and gradients are finite for every
image, those without variation or without a return included.

Source: M.-Y. Yu, R. Vasudevan, M. Johnson-Roberson, "LiSnowNet: Real-time Snow Removal for LiDAR
Point Clouds", IROS 2022.
"""

from collections.abc import Callable
from typing import NamedTuple

import torch
from torch import Tensor

from derain.learning.losses import at_least_float32
from derain.models.lisnownet.network import haar

# What the residual takes the mean of, by the name of its norm: each change's size, or its square.
RESIDUALS: dict[str, Callable[[Tensor], Tensor]] = {"l1": torch.abs, "l2": torch.square}


class SparsityLoss(NamedTuple):
    """A loss and its parts, each a scalar."""

    loss: Tensor
    wavelet: Tensor
    fourier: Tensor
    residual: Tensor


def sparsity_loss(
    denoised: Tensor, image: Tensor, valid: Tensor, alpha: float, beta: float, norm: str = "l1"
) -> SparsityLoss:
    """Distance of denoised images from sparse ones, and from their inputs.

    With w = 1 - 2^-alpha the loss is w (beta wavelet + (1 - beta) fourier) + (1 - w) residual.

    Args:
        denoised: Output of the network for the images, float (B, C, H, W), any size.
        image: The images, float (B, C, H, W); what empty pixels hold does not matter.
        valid: True for pixels with a return, bool (B, 1, H, W).
        alpha: Weight of sparsity against the residual, at least 0.
        beta: Share of the wavelet part in sparsity, 0 to 1.
        norm: Norm of the residual, one of ``RESIDUALS``.
    """
    with torch.autocast(denoised.device.type, enabled=False):
        denoised, image = at_least_float32(denoised), at_least_float32(image)
        folded = fold_checkerboard(denoised - denoised.mean(dim=-1, keepdim=True))
        wavelet, fourier = wavelet_sparsity(folded), fourier_sparsity(folded)
        residual = mean_residual(denoised, image, valid, norm)
        weight = 1 - 2**-alpha
        sparsity = beta * wavelet + (1 - beta) * fourier
        return SparsityLoss(weight * sparsity + (1 - weight) * residual, wavelet, fourier, residual)


def fold_checkerboard(image: Tensor) -> Tensor:
    """Rearranges an image of a full turn so that it is periodic in height, too.

    The cells of a checkerboard whose row and column add up to an odd number make one image of half
    the width, the others another, which stands upside down below the first. An odd width is made
    even by the first column, the next one round the circle.

    Args:
        image: (B, C, H, W).

    Returns:
        (B, C, 2 H, ceil(W / 2)).
    """
    height, width = image.shape[-2:]
    image = torch.cat([image, image[..., : width % 2]], dim=-1)
    left, right = image[..., ::2], image[..., 1::2]
    odd_row = (torch.arange(height, device=image.device) % 2 == 1)[:, None]
    odd_cells = torch.where(odd_row, left, right)
    even_cells = torch.where(odd_row, right, left)
    return torch.cat([odd_cells, even_cells.flip(-2)], dim=-2)


def wavelet_sparsity(image: Tensor) -> Tensor:
    """Mean magnitude of the Haar details, each level weighing a quarter of the one before.

    Args:
        image: float (B, C, H, W). It is halved floor(log2 H) - 2 times as published, or as often
            as both sides can be halved; it is 0 where they cannot.
    """
    channels, height, width = image.shape[-3:]
    loss = image.new_zeros(())
    for level in range(wavelet_levels(height, width)):
        bands = haar(image)
        loss = loss + bands[:, channels:].abs().mean() / 4**level
        image = bands[:, :channels] / 2
    return loss


def wavelet_levels(height: int, width: int) -> int:
    """Number of times that :func:`wavelet_sparsity` halves an image."""
    published = max(height.bit_length() - 3, 0)
    return min(published, _times_even(height), _times_even(width))


def fourier_sparsity(image: Tensor) -> Tensor:
    """Mean log(1 + magnitude) of the real and of the imaginary parts of the Fourier transform.

    Args:
        image: float (B, C, H, W).
    """
    spectrum = torch.fft.rfft2(image, norm="ortho")
    return torch.view_as_real(spectrum).abs().log1p().mean()


def mean_residual(denoised: Tensor, image: Tensor, valid: Tensor, norm: str = "l1") -> Tensor:
    """Mean |denoised - image|, or its square, over all channels of all pixels with a return.

    Args:
        denoised: float (B, C, H, W).
        image: float (B, C, H, W).
        valid: bool (B, 1, H, W). Where no pixel is valid, the residual is 0.
        norm: One of ``RESIDUALS``.
    """
    residual = RESIDUALS[norm](torch.where(valid, denoised - image, 0))
    return residual.sum() / valid.expand_as(residual).sum().clamp(min=1)


def _times_even(number: int) -> int:
    """Number of times that a positive number can be halved evenly."""
    return (number & -number).bit_length() - 1
