"""Padding of images for networks: to a size that halves evenly, or continued past the edges."""

from collections.abc import Callable
from typing import Any

import torch
from torch import Tensor
from torch.autograd.function import once_differentiable
from torch.nn import functional


def pad_to_multiple(image: Tensor, multiple: int, value: float) -> Tensor:
    """Pads an image at the bottom and on the right until its sides are multiples.

    An image that fits comes back as it is. To undo it, slice: ``[..., :height, :width]``.

    Args:
        image: Image, (B, channels, H, W).
        multiple: Divisor of both sides, in pixels.
        value: Value of the new pixels, in every channel.

    Returns:
        Image of the same dtype, (B, channels, ≥ H, ≥ W).
    """
    height, width = image.shape[-2:]
    below, right = -height % multiple, -width % multiple
    if not (below or right):
        return image
    return functional.pad(image, (0, right, 0, below), value=value)


def pad_around(image: Tensor, margin: int) -> Tensor:
    """Continues an image past its edges: around the circle in width, then mirrored in height.

    The edge rows are the mirrors, and are not repeated. What lies beyond the opposite edge comes
    from going round again, or from mirroring to and fro: a single row is repeated. So images of
    every size are defined, as :func:`numpy.pad` defines them in its modes ``wrap`` and ``reflect``.

    Made of slices: ONNX has circular padding only from opset 19 on, and the gradient of PyTorch's
    mirrored padding is not deterministic on GPUs.

    Source: LiSnowNet (Yu et al., IROS 2022), the padding of its convolutions.

    Args:
        image: (..., H, W).
        margin: Rows and columns to add on each side, at least 1.

    Returns:
        (..., H + 2 margin, W + 2 margin).
    """
    if image.requires_grad and not torch.compiler.is_compiling():  # which an export is, too
        padded: Tensor = _Padding.apply(image, margin)
        return padded
    return _padded(image, margin)


class _Padding(torch.autograd.Function):
    """Adds the gradients of what continues an image to those of where it was taken from.

    PyTorch's own gradient of a slice is an image of zeros that holds it, one for each slice.
    """

    @staticmethod
    def forward(ctx: Any, image: Tensor, margin: int) -> Tensor:
        ctx.margin = margin
        return _padded(image, margin)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, None]:
        height, width = (side - 2 * ctx.margin for side in gradient.shape[-2:])
        gradient = _folded(gradient, -2, ctx.margin, lambda row: _mirrored(row, height))
        return _folded(gradient, -1, ctx.margin, lambda column: column % width), None


def _padded(image: Tensor, margin: int) -> Tensor:
    height, width = image.shape[-2:]
    image = _continued(image, -1, margin, lambda column: column % width)
    return _continued(image, -2, margin, lambda row: _mirrored(row, height))


def _continued(image: Tensor, dim: int, margin: int, source: Callable[[int], int]) -> Tensor:
    """Adds the slices that ``source`` names for the places before and after the image."""
    size = image.shape[dim]
    before = [image.narrow(dim, source(place), 1) for place in range(-margin, 0)]
    after = [image.narrow(dim, source(place), 1) for place in range(size, size + margin)]
    return torch.cat([*before, image, *after], dim)


def _folded(gradient: Tensor, dim: int, margin: int, source: Callable[[int], int]) -> Tensor:
    """Undoes :func:`_continued`: adds every added slice to the one that it is a copy of."""
    size = gradient.shape[dim] - 2 * margin
    inner = gradient.narrow(dim, margin, size).clone()
    for place in (*range(-margin, 0), *range(size, size + margin)):
        inner.narrow(dim, source(place), 1).add_(gradient.narrow(dim, margin + place, 1))
    return inner


def _mirrored(row: int, height: int) -> int:
    """Row of the image that replaces one beyond its edges."""
    period = max(2 * (height - 1), 1)
    return min(row % period, -row % period)
