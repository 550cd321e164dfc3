"""The two-dimensional Haar transform of images, one level of it, and its inverse.

Each 2 × 2 block of pixels, read as (top left, top right, bottom left, bottom right), is multiplied
by an orthonormal basis, which is symmetric and so its own inverse. Energy is kept.

Plain slices and sums: in onnxruntime they are as fast as strided convolutions or pixel shuffles.

Source: A. Haar, 1910; the order of pixels and bands is that of LiSnowNet (Yu et al., IROS 2022).
"""

import torch
from torch import Tensor


def haar(image: Tensor) -> Tensor:
    """Transforms an image.

    Args:
        image: float (B, C, H, W), H and W even.

    Returns:
        float (B, 4 C, H / 2, W / 2), band by band: the averages (times 2) of all channels, then
        their details from top to bottom, from left to right, and along the diagonal.
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
