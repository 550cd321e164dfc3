"""The network of 3D-OutDet, as it is trained and as it is exported.

Source: A. M. Raisuddin, T. Cortinhal, J. Holmblad, E. E. Aksoy, "3D-OutDet: A Fast and Memory
Efficient Outlier Detector for 3D LiDAR Point Clouds in Adverse Weather", IEEE IV 2024;
sporsho/3D_OutDet (MIT).
"""

from collections.abc import Mapping
from typing import Any, Self

import torch
from torch import Tensor, nn
from torch.autograd.function import once_differentiable
from torch.nn import functional

from derain.models.layers.batch_norm import PointBatchNorm
from derain.models.published import network_of, published_tensors

# Features of every point in each layer.
WIDTH = 32

# The published network sees every distance one metre longer than it is; without that offset its
# published weights are worthless (IoU .00014 instead of .834 on WADS).
DISTANCE_OFFSET = 1.0

# Where each of our parameters stands in the published state_dict.
PUBLISHED_KEYS = {
    "distance_weight": "convs.0.conv1.dw",
    "weight1": "convs.0.conv1.weight",
    "bias1": "convs.0.conv1.b",
    "weight2": "convs.0.conv2.weight",
    "shortcut": "convs.0.downsample.weight",
    "head.weight": "fc.weight",
    "head.bias": "fc.bias",
    **{
        f"norm{layer}.{tensor}": f"convs.0.bn{layer}.{tensor}"
        for layer in (1, 2)
        for tensor in ("weight", "bias", "running_mean", "running_var", "num_batches_tracked")
    },
}

# Points whose neighbourhoods are gathered at a time. Those of all points of a WADS scan have nine
# times their features, 140 MB; those of this many stay in a processor's cache.
POINT_BLOCK = 2048

# The second convolution gathers k times the features of all points. In blocks, what is gathered
# stays in the processor's cache, and a scan of 400,000 points needs 29 MB for it and not 460.
BLOCKS = 16


class OutDetNetwork(nn.Module):
    """The network as published, from normalised points to logits.

    Example:
        >>> network = OutDetNetwork(neighbours=3).eval()
        >>> points, distances = torch.rand(6, 4), torch.rand(6, 3)
        >>> neighbours = torch.randint(6, (6, 3))
        >>> network(points, distances, neighbours).shape
        torch.Size([6, 2])

    Args:
        neighbours: k, the size of a neighbourhood, the point itself included.
        channels: Number of input channels, 4 as published.
    """

    def __init__(self, neighbours: int = 9, channels: int = 4) -> None:
        super().__init__()
        self.distance_weight = nn.Parameter(torch.ones(neighbours))
        self.weight1 = nn.Parameter(torch.empty(channels + 1, WIDTH, neighbours))
        self.bias1 = nn.Parameter(torch.randn(WIDTH))
        self.norm1 = PointBatchNorm(WIDTH)
        self.weight2 = nn.Parameter(torch.empty(WIDTH, WIDTH, neighbours))
        self.norm2 = PointBatchNorm(WIDTH)
        self.shortcut = nn.Parameter(torch.empty(WIDTH, channels, 1))
        self.dropout = nn.Dropout(0.5)
        self.head = nn.Linear(WIDTH, 2)
        for weight in (self.weight1, self.weight2, self.shortcut):
            nn.init.xavier_normal_(weight)

    @classmethod
    def from_published(cls, state_dict: Mapping[str, Tensor]) -> Self:
        """Builds the network from a published state_dict, with or without ``module.`` prefixes.

        Raises:
            InputError: A state_dict of another network.
        """
        tensors = published_tensors(state_dict, PUBLISHED_KEYS, "3D-OutDet")
        neighbours = tensors["distance_weight"].numel()
        return network_of(lambda: cls(neighbours), tensors, "3D-OutDet")

    def forward(
        self,
        points: Tensor,
        distances: Tensor,
        neighbours: Tensor,
        candidates: Tensor | None = None,
    ) -> Tensor:
        """Scores every point, or every candidate.

        Args:
            points: Normalised channels, float (M, C).
            distances: Distances to the neighbours in metres, float (F, k).
            neighbours: The point itself, then its neighbours, as rows of ``points``, int64 (F, k).
            candidates: Neighbourhoods of the points around each candidate, as rows of
                ``neighbours``, the first being its own, int64 (J, k). None where all M points are
                judged, each by its own neighbourhood: F = J = M.

        Returns:
            Logits of "not rain" and "rain", float (J, 2).
        """
        # Points and distances are convolved apart, so that no copy joins them before.
        on_distances = (self.weight1[-1] * self.distance_weight).T
        features = convolve(points, neighbours, self.weight1[:-1])
        features = features + (distances + DISTANCE_OFFSET) @ on_distances + self.bias1
        features = functional.leaky_relu(self.norm1(features), 0.2)
        own, around = judged(points, neighbours, candidates)
        features = self.norm2(convolve(features, around, self.weight2))
        features = features + own @ self.shortcut[..., 0].T
        features = functional.leaky_relu(features, 0.2)
        return self.head(self.dropout(features))


def judged(points: Tensor, neighbours: Tensor, candidates: Tensor | None) -> tuple[Tensor, Tensor]:
    """The points that are judged, and where the features of their neighbours are.

    Args:
        points: Channels of all points, float (M, C).
        neighbours: As for :class:`OutDetNetwork`, int64 (F, k).
        candidates: As there, int64 (J, k) or None.

    Returns:
        Channels, float (J, C), and rows among the features of F points, int64 (J, k).
    """
    if candidates is None:
        return points, neighbours
    # The first neighbour of each is the point itself. An embedding exports as Gather.
    own = neighbours[:, 0].index_select(0, candidates[:, 0])
    return functional.embedding(own, points), candidates


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
        blocks = zip(result.split(POINT_BLOCK), neighbours.split(POINT_BLOCK), strict=True)
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
        blocks = zip(gradient.split(POINT_BLOCK), neighbours.split(POINT_BLOCK), strict=True)
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
