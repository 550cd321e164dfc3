"""How LiSnowNet sees past the edges of a range image."""

from collections.abc import Callable

import torch
from torch import Tensor


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
    height, width = image.shape[-2:]
    image = _continued(image, -1, margin, lambda column: column % width)
    return _continued(image, -2, margin, lambda row: _mirrored(row, height))


def _continued(image: Tensor, dim: int, margin: int, source: Callable[[int], int]) -> Tensor:
    """Adds the slices that ``source`` names for the places before and after the image."""
    size = image.shape[dim]
    before = [image.narrow(dim, source(place), 1) for place in range(-margin, 0)]
    after = [image.narrow(dim, source(place), 1) for place in range(size, size + margin)]
    return torch.cat([*before, image, *after], dim)


def _mirrored(row: int, height: int) -> int:
    """Row of the image that stands for one beyond its edges."""
    period = max(2 * (height - 1), 1)
    return min(row % period, -row % period)
