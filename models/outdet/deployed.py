"""3D-OutDet as it is exported: the same function in fewer steps."""

from collections.abc import Mapping

import torch
from torch import Tensor, nn
from torch.nn import functional

from derain.models.outdet.network import DISTANCE_OFFSET, OutDetNetwork, judged

# The second convolution gathers k times the features of all points. In blocks, what is gathered
# stays in the processor's cache, and a scan of 400,000 points needs 29 MB for it and not 460.
BLOCKS = 16


class FoldedOutDet(nn.Module):
    """The same function in fewer steps, for deployment: from raw points to logits.

    The input's normalisation, the distances' weight and offset and both BatchNorms, all affine in
    evaluation mode, are folded into the matrices beside them.

    Args:
        network: A trained network.
        mean: Mean of each input channel, float (C,).
        std: Standard deviation of each input channel, float (C,).
    """

    def __init__(self, network: OutDetNetwork, mean: Tensor, std: Tensor) -> None:
        super().__init__()
        # Folding in float64 adds no rounding of its own.
        exact = {name: tensor.double() for name, tensor in network.state_dict().items()}
        mean, std = mean.double(), std.double()
        scale1, shift1 = _affine(exact, "norm1", network.norm1.eps)
        scale2, shift2 = _affine(exact, "norm2", network.norm2.eps)

        weight1 = exact["weight1"] * scale1[:, None]
        on_points = weight1[:-1] / std[:, None, None]
        on_distances = weight1[-1] * exact["distance_weight"]
        bias1 = exact["bias1"] * scale1 + shift1
        bias1 = bias1 - (on_points * mean[:, None, None]).sum(dim=(0, 2))
        bias1 = bias1 + DISTANCE_OFFSET * on_distances.sum(dim=1)
        shortcut = (exact["shortcut"][..., 0] / std).T

        self.on_points = _constant(on_points.permute(2, 0, 1).flatten(0, 1))
        self.on_distances = _constant(on_distances.T)
        self.bias1 = _constant(bias1)
        self.weight2 = _constant(
            (exact["weight2"] * scale2[:, None]).permute(2, 0, 1).flatten(0, 1)
        )
        self.shortcut = _constant(shortcut)
        self.bias2 = _constant(shift2 - mean @ shortcut)
        self.head = _constant(exact["head.weight"].T)
        self.head_bias = _constant(exact["head.bias"])

    def forward(
        self,
        points: Tensor,
        distances: Tensor,
        neighbours: Tensor,
        candidates: Tensor | None = None,
    ) -> Tensor:
        """Scores every point, or every candidate; arguments as for :class:`OutDetNetwork`.

        Args:
            points: Raw channels in the units of the Spec, float32 (M, C).
            distances: float32 (F, k).
            neighbours: int64 (F, k).
            candidates: int64 (J, k).

        Returns:
            Logits of "not rain" and "rain", float32 (J, 2).
        """
        # An embedding exports as Gather, which runs faster than the GatherND of plain indexing.
        features = functional.embedding(neighbours, points).flatten(1) @ self.on_points + self.bias1
        features = functional.leaky_relu(features + distances @ self.on_distances, 0.2)
        own, around = judged(points, neighbours, candidates)
        size = (around.shape[0] + BLOCKS - 1) // BLOCKS
        blocks = [
            functional.embedding(around[start * size : (start + 1) * size], features).flatten(1)
            @ self.weight2
            for start in range(BLOCKS)
        ]
        features = torch.cat(blocks) + self.bias2 + own @ self.shortcut
        features = functional.leaky_relu(features, 0.2)
        return features @ self.head + self.head_bias


def _affine(exact: Mapping[str, Tensor], norm: str, eps: float) -> tuple[Tensor, Tensor]:
    """Scale and shift of a BatchNorm in evaluation mode."""
    scale = exact[f"{norm}.weight"] / (exact[f"{norm}.running_var"] + eps).sqrt()
    return scale, exact[f"{norm}.bias"] - exact[f"{norm}.running_mean"] * scale


def _constant(tensor: Tensor) -> nn.Parameter:
    return nn.Parameter(tensor.float().contiguous(), requires_grad=False)
