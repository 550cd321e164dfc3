"""A network of one's own, in one file outside derain: it trains, exports, proves and benches.

A small perceptron judges each point by its height, its intensity and how far its neighbours are::

    PYTHONPATH=examples derain fit --model toy_network.Toy --data Wads --data.root WADS

Readers of its checkpoints look up a network named ``toy``. derain finds it once the package of this
module names it in its ``pyproject.toml`` and is installed::

    [project.entry-points."derain.networks"]
    toy = "toy_network"

From then on ``derain export``, ``info`` and all other commands accept it like networks of derain.
"""

from collections.abc import Sequence
from typing import Any, ClassVar

import torch
from torch import Tensor, nn

from derain.models.registry import NETWORKS
from derain.models.supervised import SupervisedModule
from derain.scan import Scan
from derain.views.neighbours import NeighbourView
from derain.views.view import View


@NETWORKS.add("toy")
class Toy(SupervisedModule):
    """Trains the perceptron.

    Args:
        neighbours: k, the size of a neighbourhood, the point itself included.
        channels: What it sees of a point besides distances.
        width: Features between its two layers.
        learning_rate: Of Adam.
        threshold: A point is rain where its probability is greater.
        spec: Set by derain when it saves a checkpoint; leave it out otherwise.
    """

    VIEW: ClassVar[type[View]] = NeighbourView

    def __init__(
        self,
        neighbours: int = 5,
        channels: tuple[str, ...] = ("z", "intensity"),
        width: int = 16,
        learning_rate: float = 0.02,
        threshold: float = 0.5,
        spec: dict[str, Any] | None = None,
    ) -> None:
        super().__init__(channels)
        self.save_hyperparameters()
        # The first distance is that of the point to itself.
        inputs = len(channels) + neighbours - 1
        self.network = nn.Sequential(nn.Linear(inputs, width), nn.ReLU(), nn.Linear(width, 2))
        self.adopt(spec)

    def view_for(self, scans: Sequence[Scan]) -> NeighbourView:
        """The network's view of a scan, which needs no fitting to scans."""
        return NeighbourView(self.hparams["neighbours"], self.channels)

    def accepts_view(self, view: View) -> bool:
        """True if it can take what a Spec's view gives: as many neighbours as it has inputs for."""
        return isinstance(view, NeighbourView) and view.neighbours == self.hparams["neighbours"]

    def forward(self, points: Tensor, distances: Tensor, neighbours: Tensor) -> Tensor:
        """Scores every point.

        Args:
            points: Raw channels in the units of the Spec, float32 (M, C).
            distances: Distances to the neighbours in metres, float32 (M, k).
            neighbours: Rows of the neighbours, int64 (M, k), which it has no use for.

        Returns:
            Logits of "not rain" and "rain", float32 (M, 2).
        """
        normalised = (points - self.mean) / self.std
        return self.network(torch.cat([normalised, distances[:, 1:].log1p()], dim=1))

    def configure_optimizers(self) -> torch.optim.Optimizer:
        """Adam."""
        return torch.optim.Adam(self.parameters(), lr=self.hparams["learning_rate"])
