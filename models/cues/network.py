"""The network: geometry, then brightness as the scan itself calibrates it, weighed together."""

import torch
from torch import Tensor, nn
from torch.nn import functional

from derain.models.cues.brightness import Histograms
from derain.models.relative_outdet.network import RelativeOutDetNetwork, both_logits
from derain.models.relative_outdet.steps import NEAREST_POINT

# Log-odds beyond this are as good as certain.
CERTAIN = 12.0

# Points of lower log-odds by geometry, that is of a probability below 1 in 150, keep its answer:
# hardly any of them is rain, and most points of a scan need not be weighed.
# Source: modelling choice.
DOUBTFUL = -5.0

# Neighbours whose cues the fusion weighs, the point itself not counted, and those of them whose
# distances it weighs.
AROUND = 8
APART = (1, 3, AROUND)

# Distances below this share of the range are not told apart.
NEAREST_APART = 1e-4

# How much of the cue of brightness is added to calibrate it once more.
# Source: modelling choice, as are the two rounds.
SHARE_ADDED = 0.5
ROUNDS = 2

# Numbers of a point that the fusion weighs.
NUMBERS = 19


class CuedNetwork(nn.Module):
    """The network, from points of one scan to logits.

    A first pass sees geometry alone. Its probabilities calibrate the cue of brightness, and a
    fusion weighs both, of the point and of its neighbours. A second round does so again, from the
    answers of the first.

    Example:
        >>> network = CuedNetwork(RelativeOutDetNetwork(neighbours=9)).eval()
        >>> points, distances = torch.rand(20, 4), torch.rand(20, 9)
        >>> neighbours = torch.arange(20)[:, None] * torch.ones(1, 9, dtype=torch.int64)
        >>> network(points, distances, neighbours).shape
        torch.Size([20, 2])

    Args:
        geometry: Scores points by where they and their neighbours are.
        width: Features of a point in the two hidden layers of a fusion.
    """

    def __init__(self, geometry: RelativeOutDetNetwork, width: int = 48) -> None:
        super().__init__()
        self.geometry = geometry
        self.rounds = nn.ModuleList(_fusion(width) for _ in range(ROUNDS))

    def forward(self, points: Tensor, distances: Tensor, neighbours: Tensor) -> Tensor:
        """Scores every point of a scan.

        Args:
            points: x, y, z in metres, in the sensor's frame, and the rank of intensity, float
                (M, 4).
            distances: Distances to the neighbours in metres, float (M, k), ascending.
            neighbours: The point itself, then its neighbours, as rows of ``points``, int64 (M, k).

        Returns:
            Logits of "not rain" and "rain", float (M, 2).
        """
        rain = self.geometry(points[:, :3], distances, neighbours)[:, 1]
        return both_logits(self.fused(rain, points, distances, neighbours)[-1])

    def fused(
        self, rain: Tensor, points: Tensor, distances: Tensor, neighbours: Tensor
    ) -> list[Tensor]:
        """Log-odds of rain after each round, float (M,).

        Gradients do not pass from one round to the one before it.

        Args:
            rain: Log-odds of rain by geometry, float (M,).
            points: As of :meth:`forward`.
            distances: As of :meth:`forward`.
            neighbours: As of :meth:`forward`.
        """
        doubtful = torch.nonzero(rain > DOUBTFUL)[:, 0]
        cues, answers = Cues(points, distances, neighbours, doubtful), []
        for fusion in self.rounds:
            with torch.no_grad():
                given = cues.around(rain)
            rain = rain.scatter(0, doubtful, fusion(given)[:, 0])
            answers.append(rain)
        return answers


def _fusion(width: int) -> nn.Module:
    """Weighs the numbers of each point, float (M, NUMBERS); log-odds of rain, float (M, 1)."""
    return nn.Sequential(
        nn.Linear(NUMBERS, width),
        nn.ReLU(),
        nn.Linear(width, width),
        nn.ReLU(),
        nn.Linear(width, 1),
    )


class Cues:
    """What is known of a scan's points, apart from how likely they are rain.

    Args:
        points: x, y, z in metres, in the sensor's frame, and the rank of intensity, float (M, 4).
        distances: Distances to the neighbours in metres, float (M, k), ascending.
        neighbours: The point itself, then its neighbours, as rows of ``points``, int64 (M, k).
        rows: Points that are weighed, int64 (S,).
    """

    def __init__(self, points: Tensor, distances: Tensor, neighbours: Tensor, rows: Tensor) -> None:
        distance = points[:, :3].square().sum(1).sqrt().clamp_min(NEAREST_POINT)
        log_range = torch.log(distance)
        self._histograms = Histograms(log_range, points[:, 3])
        apart = distances[rows][:, APART] / distance[rows][:, None]
        # Shifted and scaled, here and below, so that all numbers are of the order of 1.
        self._places = torch.cat(
            [
                (log_range[rows] - 2)[:, None],
                torch.log(apart + NEAREST_APART) + 4,
                points[rows][:, 3:],
            ],
            dim=1,
        )
        self._neighbours = neighbours[rows][:, 1 : AROUND + 1]
        self._rows = rows

    def around(self, rain: Tensor) -> Tensor:
        """The cues of each point that is weighed and of its neighbours, float (S, NUMBERS).

        Args:
            rain: Log-odds of rain, float (M,), which calibrate the cue of brightness.
        """
        rain = rain.clamp(-CERTAIN, CERTAIN)
        rows, shell, cell = self._rows, self._histograms.shell, self._histograms.cell
        own = rain[rows]
        first = self._histograms.brightness(rows, own.sigmoid())
        first_odds = first.log_odds[cell[rows]]
        second = self._histograms.brightness(rows, (own + SHARE_ADDED * first_odds).sigmoid())
        given = torch.stack([rain / 4, second.log_odds[cell] / 2, rain.sigmoid()], dim=1)
        of_neighbours = functional.embedding(self._neighbours, given)
        of_shell = torch.stack([torch.log1p(second.rain) / 4, second.separation, second.share], 1)
        of_scan = torch.log1p(own.sigmoid().double().sum()).to(rain.dtype) / 4
        return torch.cat(
            [
                given[rows][:, :2],
                (first_odds / 2)[:, None],
                of_neighbours.mean(dim=1),
                of_neighbours[:, :, :2].amax(dim=1),
                of_neighbours[:, :, :2].amin(dim=1),
                of_shell[shell[rows]],
                of_scan.expand_as(own)[:, None],
                self._places,
            ],
            dim=1,
        )
