"""The network of 3D-OutDet: two convolutions over each point's nearest neighbours.

Source: A. M. Raisuddin, T. Cortinhal, J. Holmblad, E. E. Aksoy, "3D-OutDet: A Fast and Memory
Efficient Outlier Detector for 3D LiDAR Point Clouds in Adverse Weather", IEEE IV 2024;
sporsho/3D_OutDet (MIT).
"""

from collections.abc import Mapping
from typing import Self

import torch
from torch import Tensor, nn
from torch.nn import functional

from derain.models.layers.batch_norm import PointBatchNorm
from derain.models.layers.neighbour_convolution import convolve
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
