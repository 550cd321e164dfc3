"""The network: a neighbourhood, what the scan holds at its range, the neighbours' opinions."""

import torch
from torch import Tensor, nn
from torch.nn import functional

from derain.models.beam_steps import (
    FARTHEST_IN_STEPS,
    NEAREST_POINT,
    NEAREST_TO_AXIS,
    NEIGHBOUR_NUMBERS,
    SHELL_REACH,
    SHELLS,
    STEP_EPSILON,
    USUAL_RANGE,
    active,
    asinh,
    both_logits,
    farther_by,
)
from derain.models.carrier import without_carrier

# A step is the angle to the third nearest beam among those of a point's neighbours. Two of the
# nearest lie on either side, along the axis of finer resolution, and another return of the point's
# own beam may be nearer still.
STEP_NEIGHBOUR = 3

# The step of a scan is the median over this many of its points, evenly spread over its rows. With
# 2,049, the answers changed with the order of the rows: one scan of snow, turned by half a degree,
# went from an IoU of .54 to .67.
SAMPLED_POINTS = 32769

# Radians; no sensor's beams lie closer together.
FINEST_ANGLE = 1e-4

# Added to what is divided by, which may be 0.
EPSILON = 1e-3


class RelativeOutDetNetwork(nn.Module):
    """The network, from points of one scan to logits.

    As 3D-OutDet it looks at each point's neighbours, and then at what it made of theirs. Between
    the two it receives what the scan holds at the range of the point: an isolated return is more
    likely a drop where there are many.

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
        opinion: Features that a point passes to the points that it is a neighbour of.
        context: Features of a shell; 0 leaves the rest of the scan out.
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

        There are no candidates: the score of a point depends on the whole scan.

        Args:
            points: x, y, z in metres, in the sensor's frame, float (M, 3).
            distances: Distances to the neighbours in metres, float (M, k).
            neighbours: The point itself, then its neighbours, as rows of ``points``, int64 (M, k).

        Returns:
            Logits of "not rain" and "rain", float (M, 2).
        """
        seen, far = in_steps(points, distances, neighbours)
        around = active(self.neighbour(seen)).flatten(1)
        features = active(_of_both(self.neighbourhood, around, far[:, None]))
        if self.has_context:
            features = features + self._context(features, far)
        heard = functional.embedding(neighbours, active(self.to_opinion(features))).flatten(1)
        features = features + active(_of_both(self.opinions, heard, features))
        rain = self.head(features)[:, 0]
        if self.training:
            return both_logits(rain)
        size = torch.ones_like(rain).double().sum()
        return both_logits(without_carrier(rain, far, size))

    def _context(self, features: Tensor, far: Tensor) -> Tensor:
        """Counts of the scan at the range of each point, and in total."""
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


def in_steps(points: Tensor, distances: Tensor, neighbours: Tensor) -> tuple[Tensor, Tensor]:
    """Positions of each point's neighbours, along its beam and across it.

    A step is the angle between neighbouring beams, the angular resolution of the sensor. It is
    taken from the scan itself: the median over its points of the angle to the third nearest among
    their neighbours' beams. In metres it is that angle times the range of the point.

    Args:
        points: x, y, z in metres, in the sensor's frame, float (M, 3).
        distances: Distances to the neighbours, metres, float (M, k).
        neighbours: The point itself, then its neighbours, as rows of ``points``, int64 (M, k).

    Returns:
        Of each neighbour but the point itself, in steps: the logarithm of its distance; and as
        inverse hyperbolic sines how much farther it is from the sensor, how far aside it is, on
        whichever side, and how far up; float (M, k - 1, 4). And the logarithms of the points'
        ranges over 10 m, float (M,).
    """
    own = functional.embedding(neighbours[:, 0], points)
    x, y, z = own.unbind(1)
    level = (x * x + y * y).sqrt().clamp_min(NEAREST_TO_AXIS)
    distance = (x * x + y * y + z * z).sqrt().clamp_min(NEAREST_POINT)
    offset = functional.embedding(neighbours[:, 1:], points) - own[:, None]
    ahead, left, up = offset.unbind(2)
    level_dot = x[:, None] * ahead + y[:, None] * left
    outwards = level_dot / level[:, None]
    aside = (x[:, None] * left - y[:, None] * ahead) / level[:, None]
    risen = (level[:, None] * up - z[:, None] * outwards) / distance[:, None]
    farther = farther_by(distance[:, None], level_dot + z[:, None] * up, distances[:, 1:])
    step = _step(aside, risen, distance)
    length = (distance * step)[:, None]
    seen = torch.stack(
        [
            torch.log(distances[:, 1:] / length + STEP_EPSILON),
            asinh(farther / length),
            asinh(aside.abs() / length),
            asinh(risen / length),
        ],
        dim=2,
    )
    return seen.clamp(-FARTHEST_IN_STEPS, FARTHEST_IN_STEPS), torch.log(distance / USUAL_RANGE)


def _step(aside: Tensor, risen: Tensor, distance: Tensor) -> Tensor:
    """The angle between neighbouring beams, radians, float (); of no points 0.1."""
    angles = (aside.square() + risen.square()).sqrt() / distance[:, None]
    # A row more, so that there is one to take the median of.
    angles = torch.cat([angles, angles.new_full((1, angles.shape[1]), 0.1)])
    some = torch.arange(SAMPLED_POINTS, device=angles.device) * distance.shape[0] // SAMPLED_POINTS
    third = angles[some].topk(STEP_NEIGHBOUR, dim=1, largest=False).values[:, -1]
    return third.topk(SAMPLED_POINTS // 2 + 1).values[-1].clamp_min(FINEST_ANGLE)
