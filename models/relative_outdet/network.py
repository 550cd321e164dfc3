"""The network: a neighbourhood, what the scan holds at its range, the neighbours' opinions."""

import torch
from torch import Tensor, nn
from torch.nn import functional

from derain.models.layers.carrier import without_carrier
from derain.models.layers.steps import (
    NEIGHBOUR_NUMBERS,
    SHELL_REACH,
    SHELLS,
    active,
)
from derain.models.relative_outdet.steps import EPSILON, in_steps


class RelativeOutDetNetwork(nn.Module):
    """The network, from points of one scan to logits.

    As 3D-OutDet it looks at each point's neighbours, and then at what it made of theirs. Between
    the two it is told what the scan holds at the range of the point: an isolated return is likelier
    a drop where there are many.

    Example:
        >>> network = RelativeOutDetNetwork(neighbours=4).eval()
        >>> points, distances = torch.rand(6, 3), torch.rand(6, 4)
        >>> neighbours = torch.arange(6)[:, None] * torch.ones(1, 4, dtype=torch.int64)
        >>> network(points, distances, neighbours).shape
        torch.Size([6, 2])

    Args:
        neighbours: k, the size of a neighbourhood, the point itself included.
        width: Features of a point.
        of_neighbour: Features of each neighbour, of where it is.
        opinion: What a point tells those that it is a neighbour of.
        context: Features of a shell; 0 tells a point nothing of the rest of its scan.
    """

    centres: Tensor

    def __init__(
        self,
        neighbours: int = 9,
        width: int = 32,
        of_neighbour: int = 8,
        opinion: int = 12,
        context: int = 16,
    ) -> None:
        super().__init__()
        self.neighbour = nn.Linear(NEIGHBOUR_NUMBERS, of_neighbour)
        self.neighbourhood = nn.Linear((neighbours - 1) * of_neighbour + 1, width)
        self.has_context = context > 0
        if self.has_context:
            self.to_context = nn.Linear(width, context)
            self.from_context = nn.Linear(2 * context, width)
        self.to_opinion = nn.Linear(width, opinion)
        self.opinions = nn.Linear(neighbours * opinion + width, width)
        self.head = nn.Linear(width, 1)
        self.register_buffer("centres", torch.linspace(*SHELLS), persistent=False)

    def forward(self, points: Tensor, distances: Tensor, neighbours: Tensor) -> Tensor:
        """Scores every point of a scan.

        There are no candidates: what is said of a point depends on the whole scan.

        Args:
            points: x, y, z in metres, in the sensor's frame, float (M, 3).
            distances: Distances to the neighbours in metres, float (M, k).
            neighbours: The point itself, then its neighbours, as rows of ``points``, int64 (M, k).

        Returns:
            Logits of "not rain" and "rain", float (M, 2).
        """
        rain, far = self.rain_and_range(points, distances, neighbours)
        if self.training:
            return both_logits(rain)
        return both_logits(without_carrier(rain, far, torch.ones_like(rain).double().sum()))

    def rain_and_range(
        self, points: Tensor, distances: Tensor, neighbours: Tensor
    ) -> tuple[Tensor, Tensor]:
        """What :meth:`forward` is made of; arguments are the same.

        Returns:
            Logits of rain, before what is likely of the carrier is taken back, float (M,); and
            logarithms of the points' ranges over the usual one, float (M,).
        """
        seen, far = in_steps(points, distances, neighbours)
        around = active(self.neighbour(seen)).flatten(1)
        features = active(_of_both(self.neighbourhood, around, far[:, None]))
        if self.has_context:
            features = features + self._context(features, far)
        heard = functional.embedding(neighbours, active(self.to_opinion(features))).flatten(1)
        features = features + active(_of_both(self.opinions, heard, features))
        return self.head(features)[:, 0], far

    def _context(self, features: Tensor, far: Tensor) -> Tensor:
        """What the scan holds at the range of each point, and in all."""
        share = torch.softmax(-(((far[:, None] - self.centres) / SHELL_REACH) ** 2), dim=1)
        context = active(self.to_context(features))
        # In float64, for sums of float32 over a whole scan differ from one runtime to another, and
        # with them the logits in their third digit.
        shares, context_double = share.double(), context.double()
        of_shell = shares.T @ context_double / (shares.sum(dim=0)[:, None] + EPSILON)
        of_all = context_double.sum(dim=0) / (context.shape[0] + EPSILON)
        of_shell, of_all = of_shell.to(context.dtype), of_all.to(context.dtype)
        of_all = of_all.expand(context.shape[0], -1)
        result: Tensor = self.from_context(torch.cat([share @ of_shell, of_all], dim=1))
        return result


def _of_both(layer: nn.Linear, first: Tensor, second: Tensor) -> Tensor:
    """A layer on two inputs side by side; they are not copied next to each other, to be faster."""
    width = first.shape[1]
    of_first = functional.linear(first, layer.weight[:, :width], layer.bias)
    return of_first + functional.linear(second, layer.weight[:, width:])


def both_logits(rain: Tensor) -> Tensor:
    """Logits of "not rain", which are 0, and of "rain", float (M, 2), of the latter, float (M,)."""
    return torch.stack([torch.zeros_like(rain), rain], dim=1)
