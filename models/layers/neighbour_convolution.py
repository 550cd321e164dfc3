"""A convolution over each point's nearest neighbours that never holds what it gathers."""

from typing import Any

import torch
from torch import Tensor
from torch.autograd.function import once_differentiable

# Points whose neighbourhoods are gathered at a time. What is gathered of all points is nine times
# their features, 140 MB of a scan of WADS, and so many points' stay in a processor's cache.
BLOCK = 2048


def convolve(features: Tensor, neighbours: Tensor, weight: Tensor) -> Tensor:
    """Convolution over neighbourhoods, as one matrix product for each block of points.

    Args:
        features: Features of every point, float (M, inputs).
        neighbours: Neighbours of some points or of all, as rows of ``features``, int64 (K, k).
        weight: Published layout, float (inputs, outputs, k).

    Returns:
        Features of those points, float (K, outputs).
    """
    matrix = weight.permute(2, 0, 1).flatten(0, 1)
    result: Tensor = _Convolution.apply(features, neighbours, matrix)
    return result


class _Convolution(torch.autograd.Function):
    """Gathers anew for the gradient: that is faster than to write it down and read it again."""

    @staticmethod
    def forward(ctx: Any, features: Tensor, neighbours: Tensor, matrix: Tensor) -> Tensor:
        ctx.save_for_backward(features, neighbours, matrix)
        result = features.new_empty(len(neighbours), matrix.shape[1])
        blocks = zip(result.split(BLOCK), neighbours.split(BLOCK), strict=True)
        for of_block, rows in blocks:
            of_block.copy_(_gathered(features, rows) @ matrix)
        return result

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor | None, None, Tensor]:
        features, neighbours, matrix = ctx.saved_tensors
        of_features = torch.zeros_like(features) if ctx.needs_input_grad[0] else None
        of_matrix = torch.zeros_like(matrix)
        turned = matrix.T.contiguous()
        blocks = zip(gradient.split(BLOCK), neighbours.split(BLOCK), strict=True)
        # Whoever asks for the gradient inside of autocast would have products of another type.
        with torch.autocast(gradient.device.type, enabled=False):
            for of_block, rows in blocks:
                of_matrix.addmm_(_gathered(features, rows).T, of_block)
                if of_features is not None:
                    of_gathered = (of_block @ turned).view(rows.numel(), features.shape[1])
                    of_features.index_add_(0, rows.flatten(), of_gathered)
        return of_features, None, of_matrix


def _gathered(features: Tensor, rows: Tensor) -> Tensor:
    """Features of each point's neighbours side by side, (rows, k · inputs)."""
    width = rows.shape[1] * features.shape[1]
    return features.index_select(0, rows.flatten()).view(len(rows), width)
