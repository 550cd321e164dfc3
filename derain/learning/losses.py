"""Losses of supervised derainers: weighted cross-entropy and the Lovász-softmax loss.

Losses take one row for each point. Of an image, take its valid pixels:
``logits.movedim(1, -1)[valid]``. Each loss has a defined, finite value and gradient for every scan:
without points, without rain, or with nothing but rain. All compute in float32 or wider.
"""

from collections.abc import Sequence
from typing import NamedTuple

import torch
from torch import Tensor
from torch.nn import functional

# Added to the share of each class, so that the weight of one that hardly occurs is finite.
LEAST_SHARE = 1e-3


class SegmentationLoss(NamedTuple):
    """A loss and the parts it is the sum of, each a scalar."""

    loss: Tensor
    cross_entropy: Tensor
    lovasz: Tensor


def segmentation_loss(logits: Tensor, target: Tensor, class_weight: Tensor) -> SegmentationLoss:
    """Weighted cross-entropy plus Lovász-softmax of two classes, as 3D-OutDet is trained.

    The cross-entropy is a mean in which each point is weighted by its class. The other is the
    Lovász extension of the Jaccard loss, 1 − IoU, averaged over the classes present: at hard 0/1
    probabilities it is the mean 1 − IoU itself; where all points are of one class c, the mean of
    1 − p_c. Both are 0 without points, and the first where no class present has a weight.

    Both classes' errors at a point are one number, the probability of the other class, so that one
    order serves both; and all follows from how far the logits lean to the wrong side.

    Source: sporsho/3D_OutDet, train_wads.py. SalsaNext (Cortinhal et al. 2020) learns from the same
    sum, with the logarithm of probabilities clamped at 1e-8 in place of the log-softmax. Berman,
    Rannen Triki and Blaschko, "The Lovász-Softmax loss", CVPR 2018, definition 2 and the loss over
    the classes present.

    Args:
        logits: Scores before the softmax, float (N, 2).
        target: Class of every point, 0 or 1, int64 (N,).
        class_weight: Weight of each class, float (2,), at least 0; see :func:`class_weights`.
    """
    logits, second = at_least_float32(logits), target == 1
    lean = logits[:, 1] - logits[:, 0]
    wrong = torch.where(second, -lean, lean)
    weight = class_weight.to(wrong)[target]
    total = weight.sum().clamp(min=torch.finfo(weight.dtype).tiny)  # 0 where all weights are
    cross_entropy = (functional.softplus(wrong) * weight).sum() / total
    order = wrong.detach().argsort(descending=True)
    ordered = second[order]
    steps = _jaccard_steps(ordered, wrong.dtype) + _jaccard_steps(~ordered, wrong.dtype)
    present = second.any().int() + (~second).any().int()
    lovasz = (wrong.sigmoid()[order] * steps).sum() / present.clamp(min=1)
    return SegmentationLoss(cross_entropy + lovasz, cross_entropy, lovasz)


def _jaccard_steps(foreground: Tensor, dtype: torch.dtype) -> Tensor:
    """Increase of the Jaccard loss with each point, as points are counted as wrong one by one.

    With the first i points wrong, the loss is 1 − intersection / union. A foreground point takes
    one from the intersection, any other adds one to the union. Both differences are written out:
    subtracting neighbouring losses would cancel all but a few digits in a scan of 400,000 points.

    Args:
        foreground: True for points of the class, those with the largest error first, bool
            (N, ...), for one class or for several.
        dtype: Floating-point type of the result.

    Returns:
        (N, ...), the gradient of the Lovász extension; zero for a class without a point.
    """
    size = foreground.sum(dim=0)
    intersection = (size - foreground.cumsum(dim=0)).to(dtype)
    union = (size + (~foreground).cumsum(dim=0)).to(dtype)
    union_before = (union - 1).clamp(min=1)  # is 0 only where the class has no point
    return torch.where(foreground, 1 / union, intersection / (union * union_before))


def class_weights(shares: Sequence[float]) -> Tensor:
    """Weights that make rare classes count, 1 / (share + 0.001); one that never occurs has 1000.

    Source: sporsho/3D_OutDet, train_wads.py; TiagoCortinhal/SalsaNext, trainer.py.

    Args:
        shares: Share of each class among the training points, 0 to 1.

    Returns:
        float32 (C,).
    """
    return torch.tensor([1 / (share + LEAST_SHARE) for share in shares])


def at_least_float32(tensor: Tensor) -> Tensor:
    """The same numbers in float32 or wider, so that sums over a scan do not overflow."""
    return tensor.to(torch.promote_types(tensor.dtype, torch.float32))
