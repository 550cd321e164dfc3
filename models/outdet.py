"""3D-OutDet: two convolutions over each point's nearest neighbours.

Source: A. M. Raisuddin, T. Cortinhal, J. Holmblad, E. E. Aksoy, "3D-OutDet: A Fast and Memory
Efficient Outlier Detector for 3D LiDAR Point Clouds in Adverse Weather", IEEE IV 2024;
sporsho/3D_OutDet (MIT).
"""

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Self

import torch
from lightning.pytorch.utilities.types import OptimizerLRScheduler
from torch import Tensor, nn
from torch.nn import functional

from derain.cards.card import DataCard
from derain.errors import InputError
from derain.models.layers.batch_norm import PointBatchNorm
from derain.models.layers.neighbour_convolution import convolve
from derain.models.published import Published, network_of, published_tensors
from derain.models.registry import NETWORKS
from derain.models.supervised import SupervisedModule
from derain.scan import Scan
from derain.views.neighbours import NeighbourView
from derain.views.view import View

# Features of every point in each layer.
WIDTH = 32

# The published network sees every distance one metre longer than it is; without that offset its
# published weights are worthless (IoU .00014 instead of .834 on WADS).
DISTANCE_OFFSET = 1.0

# The second convolution gathers k times the features of all points. In blocks, what is gathered
# stays in the processor's cache, and a scan of 400,000 points needs 29 MB for it and not 460.
BLOCKS = 16

# Where each of our parameters stands in the published state_dict.
PUBLISHED_KEYS = {
    "distance_weight": "convs.0.conv1.dw",
    "weight1": "convs.0.conv1.weight",
    "bias1": "convs.0.conv1.b",
    "norm1.weight": "convs.0.bn1.weight",
    "norm1.bias": "convs.0.bn1.bias",
    "norm1.running_mean": "convs.0.bn1.running_mean",
    "norm1.running_var": "convs.0.bn1.running_var",
    "norm1.num_batches_tracked": "convs.0.bn1.num_batches_tracked",
    "weight2": "convs.0.conv2.weight",
    "norm2.weight": "convs.0.bn2.weight",
    "norm2.bias": "convs.0.bn2.bias",
    "norm2.running_mean": "convs.0.bn2.running_mean",
    "norm2.running_var": "convs.0.bn2.running_var",
    "norm2.num_batches_tracked": "convs.0.bn2.num_batches_tracked",
    "shortcut": "convs.0.downsample.weight",
    "head.weight": "fc.weight",
    "head.bias": "fc.bias",
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
        own, around = _judged(points, neighbours, candidates)
        features = self.norm2(convolve(features, around, self.weight2))
        features = features + own @ self.shortcut[..., 0].T
        features = functional.leaky_relu(features, 0.2)
        return self.head(self.dropout(features))


def _judged(points: Tensor, neighbours: Tensor, candidates: Tensor | None) -> tuple[Tensor, Tensor]:
    """The points that are judged, and the rows of the features of their neighbours."""
    if candidates is None:
        return points, neighbours
    # The first neighbour of each is the point itself. This exports as Gather; see FoldedOutDet.
    own = neighbours[:, 0].index_select(0, candidates[:, 0])
    return functional.embedding(own, points), candidates


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
        own, around = _judged(points, neighbours, candidates)
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


@NETWORKS.add("outdet")
class OutDet(SupervisedModule, Published):
    """Trains 3D-OutDet; the defaults are the published recipe for WADS.

    Example:
        >>> trainer = Trainer(max_epochs=2, logger=False, enable_progress_bar=False)
        >>> data = derain.Folder(".", "wads", train=["scan.bin"], validation=["scan.bin"])
        >>> model = OutDet(neighbours=5)
        >>> trainer.fit(model, data)
        >>> trainer.global_step, model.spec.data
        (2, 'WADS')

    Args:
        neighbours: k, the size of a neighbourhood, the point itself included.
        channels: What it sees of a point besides distances: ``x``, ``y``, ``z``, ``range``,
            ``intensity``, ``radar``, or other columns of the scans, such as ``doppler``.
        learning_rate: Of Adam.
        weight_decay: Of Adam.
        milestones: Epochs after which the learning rate falls.
        decay: Factor by which it falls.
        threshold: A point is rain where its probability is greater.
        candidates: Share of the training scans' rain that must lie within a few bounds (range,
            height, intensity), outside which no point is judged, nor is any rain, such as 0.999.
            As published, None: all are judged.
        spec: Set by derain when it saves a checkpoint; leave it out otherwise.

    Source: sporsho/3D_OutDet, train_wads.py.
    """

    VIEW: ClassVar[type[View]] = NeighbourView
    # As published.
    CHANNELS: ClassVar[tuple[str, ...]] = ("x", "y", "z", "intensity")
    network: OutDetNetwork

    def __init__(
        self,
        neighbours: int = 9,
        channels: tuple[str, ...] = CHANNELS,
        learning_rate: float = 1e-3,
        weight_decay: float = 1e-4,
        milestones: tuple[int, ...] = (30, 40, 45),
        decay: float = 0.1,
        threshold: float = 0.5,
        candidates: float | None = None,
        spec: dict[str, Any] | None = None,
    ) -> None:
        super().__init__(channels)
        self.save_hyperparameters()
        self.network = OutDetNetwork(neighbours, len(channels))
        self.adopt(spec)

    @classmethod
    def from_published(
        cls, state_dict: Mapping[str, Tensor], card: DataCard, grid: str | None = None
    ) -> Self:
        """Builds the model from a published state_dict, with or without ``module.`` prefixes.

        Raises:
            InputError: A state_dict of another network, or a grid, which it does not see through.
        """
        if grid is not None:
            raise InputError("--grid", f"{cls.NAME} sees neighbours, not a grid", "Leave it out.")
        network = OutDetNetwork.from_published(state_dict)
        model = cls(neighbours=len(network.distance_weight))
        model.network = network
        model.adopt(model.spec_for(card))
        return model

    def view_for(self, scans: Sequence[Scan]) -> NeighbourView:
        """The view that the network sees a scan through, whatever the scans."""
        return NeighbourView(self.hparams["neighbours"], self.channels)

    def sees_through(self, view: View) -> bool:
        """Whether the network can take what a Spec's view gives: as many neighbours as it has."""
        return isinstance(view, NeighbourView) and view.neighbours == self.hparams["neighbours"]

    def forward(
        self,
        points: Tensor,
        distances: Tensor,
        neighbours: Tensor,
        candidates: Tensor | None = None,
    ) -> Tensor:
        """Logits, float (J, 2), of raw points; arguments as for :class:`FoldedOutDet`."""
        normalised = (points - self.mean) / self.std
        return self.network(normalised, distances, neighbours, candidates)

    def deployed(self) -> FoldedOutDet:
        """The network as it is exported, in fewer steps."""
        return FoldedOutDet(self.network, self.mean, self.std)

    def configure_optimizers(self) -> OptimizerLRScheduler:
        """Adam with a learning rate that falls in steps."""
        optimizer = torch.optim.Adam(
            self.parameters(),
            lr=self.hparams["learning_rate"],
            weight_decay=self.hparams["weight_decay"],
        )
        schedule = torch.optim.lr_scheduler.MultiStepLR(
            optimizer, list(self.hparams["milestones"]), self.hparams["decay"]
        )
        return {"optimizer": optimizer, "lr_scheduler": schedule}
