"""The cue of geometry: how a point lies among its neighbours."""

import torch
from torch import Tensor, nn
from torch.nn import functional

from derain.views.isolated_points import SHELL_MIDDLES

# Nothing is measured nearer than this, metres, nor right above the sensor; both keep every
# division finite.
NEAREST_POINT = 0.05
NEAREST_TO_AXIS = 0.01

# Added to what logarithms are taken of, which may be 0.
STEP_EPSILON = 1e-2

# Ranges are logarithms over this one, metres.
USUAL_RANGE = 10.0

# However far a neighbour is, no number that describes it is greater.
FARTHEST_IN_STEPS = 10.0

# How many numbers describe where a neighbour is.
NEIGHBOUR_NUMBERS = 4

# Slope of every activation below 0.
NEGATIVE_SLOPE = 0.1

# Centres of shells around the sensor in which what a scan holds is averaged: logarithms of their
# ranges over 10 m, which are 1.7 to 90 m, and how far each shell reaches into the next.
CENTRES = (-1.8, 2.2, 9)
SHELL_REACH = 0.35

# Added to what is divided by, which may be 0.
EPSILON = 1e-3


class AcrossFeatures(nn.Linear):
    """As ``nn.Linear``, of features in the first axis and things in the second.

    So everything that is computed for each of many things, such as the points of a scan, goes along
    memory: in onnxruntime the networks of derain take half the time of the other order.

    Example:
        >>> AcrossFeatures(3, 5)(torch.rand(3, 1000)).shape
        torch.Size([5, 1000])
    """

    def forward(self, features: Tensor) -> Tensor:
        """Features, float (out, N), of features, float (in, N)."""
        return torch.addmm(self.bias[:, None], self.weight, features)


class Geometry(nn.Module):
    """Scores isolated points by where they and their neighbours are.

    As 3D-OutDet it looks at each point's neighbours, and then at what it made of theirs. Between
    the two it receives what the scan holds at the range of the point: an isolated return is
    likelier a drop where there are many. It knows which neighbours are crowded.

    Points are in the last axis everywhere, which is the quickest to compute.

    Args:
        neighbours: k, the size of a neighbourhood, the point itself included.
        width: Features of a point.
        of_neighbour: Features of each neighbour, of where it is.
        opinion: Features that a point passes to the points that it is a neighbour of.
        context: Features of a shell around the sensor.
    """

    centres: Tensor
    middles: Tensor

    def __init__(
        self, neighbours: int, width: int, of_neighbour: int, opinion: int, context: int
    ) -> None:
        super().__init__()
        self.around = (neighbours - 1) * of_neighbour
        self.neighbour = AcrossFeatures(NEIGHBOUR_NUMBERS + 1, of_neighbour)
        self.neighbourhood = AcrossFeatures(self.around + 1, width)
        self.to_context = AcrossFeatures(width, context)
        self.from_context = nn.Linear(context + 1, width)
        self.from_scan = nn.Linear(context, width)
        self.to_opinion = AcrossFeatures(width, opinion)
        self.of_crowded = nn.Parameter(torch.zeros(1, opinion))
        self.from_opinions = nn.Linear(neighbours * opinion, width, bias=False)
        self.opinions = AcrossFeatures(width, width)
        self.head = AcrossFeatures(width, 1)
        self.register_buffer("centres", torch.linspace(*CENTRES)[:, None], persistent=False)
        middles = torch.from_numpy(SHELL_MIDDLES / USUAL_RANGE).log().float()
        self.register_buffer("middles", middles, persistent=False)

    def forward(
        self, seen: Tensor, far: Tensor, others: Tensor, counts: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Scores the S isolated points of a scan.

        Args:
            seen: Where their neighbours are, float (NEIGHBOUR_NUMBERS, k - 1, S), and ...
            far: ... logarithms of their ranges over the usual one, float (S,), as of
                :func:`~derain.models.cues.geometry.in_steps`.
            others: The point itself, then its neighbours, as numbers of isolated points; S where
                they are crowded; int64 (k, S).
            counts: Points of the scan by shell and rank of intensity, float (SHELLS, RANKS).

        Returns:
            Features, float (width, S), and log-odds of rain, float (S,).
        """
        crowded = (others[1:] == far.shape[0]).to(seen.dtype)
        seen = torch.cat([seen, crowded[None]]).flatten(1)
        around = active(self.neighbour(seen)).reshape(self.around, -1)
        features = active(self.neighbourhood(torch.cat([around, far[None]])))
        features = features + self._context(features, far, counts.sum(dim=1))
        opinions = torch.cat([active(self.to_opinion(features)).T, self.of_crowded])
        heard = functional.embedding(others.T, opinions).flatten(1)
        features = features + active(self.from_opinions(heard).T + self.opinions(features))
        return features, self.head(features)[0]

    def _context(self, features: Tensor, far: Tensor, points: Tensor) -> Tensor:
        """Counts of the scan at the range of each point, and in total, over all of its points.

        Args:
            features: Of isolated points, float (width, S).
            far: Logarithms of their ranges, float (S,).
            points: All points of the scan in each shell of the view, float (SHELLS,).

        Returns:
            float (width, S).
        """
        shares = self._shares(far)
        context = active(self.to_context(features))
        # In float64, for sums of float32 over a whole scan differ from one runtime to another, and
        # with them the logits in their third digit. With a row of ones, one product has all sums.
        one = torch.ones_like(far)[None]
        held = torch.cat([context, one]).double() @ torch.cat([shares, one]).double().T
        in_shell = (self._shares(self.middles).double() @ points.double()) + EPSILON
        of_shell = (held[:, :-1] / in_shell).to(far.dtype)
        of_scan = (held[:-1, -1] / (points.double().sum() + EPSILON)).to(far.dtype)
        result: Tensor = self.from_context(of_shell.T).T @ shares
        return result + self.from_scan(of_scan)[:, None]

    def _shares(self, far: Tensor) -> Tensor:
        """Share of each logarithm of range that belongs to each centre, float (centres, S)."""
        return torch.softmax(-(((far - self.centres) / SHELL_REACH) ** 2), dim=0)


def in_steps(
    points: Tensor, distances: Tensor, neighbours: Tensor, step: Tensor
) -> tuple[Tensor, Tensor]:
    """Positions of each point's neighbours, along its beam and across it.

    A step is the angle between neighbouring beams, the angular resolution of the sensor. In metres
    it is that angle times the range of the point.

    Args:
        points: x, y, z in metres, in the sensor's frame, float (M, 3).
        distances: Distances to the neighbours, metres, float (k, S).
        neighbours: Of each of S points itself, then its neighbours, as numbers of ``points``, int64
            (k, S).
        step: Radians, float ().

    Returns:
        Of each neighbour but the point itself, in steps: the logarithm of its distance; and as
        inverse hyperbolic sines how much farther it is from the sensor, how far aside it is, on
        whichever side, and how far up; float (NEIGHBOUR_NUMBERS, k - 1, S). And the logarithms of
        the points' ranges over 10 m, float (S,).
    """
    places = taken_of_each(points.T, neighbours.flatten()).reshape(3, *neighbours.shape)
    x, y, z = places[:, 0]
    ahead, left, up = places[:, 1:] - places[:, :1]
    level = (x * x + y * y).sqrt().clamp_min(NEAREST_TO_AXIS)
    distance = (x * x + y * y + z * z).sqrt().clamp_min(NEAREST_POINT)
    level_dot = x * ahead + y * left
    outwards = level_dot / level
    aside = (x * left - y * ahead) / level
    risen = (level * up - z * outwards) / distance
    farther = farther_by(distance, level_dot + z * up, distances[1:])
    per_step = 1 / (distance * step)
    seen = torch.stack(
        [
            torch.log(distances[1:] * per_step + STEP_EPSILON),
            asinh(farther * per_step),
            asinh(aside.abs() * per_step),
            asinh(risen * per_step),
        ]
    )
    return seen.clamp(-FARTHEST_IN_STEPS, FARTHEST_IN_STEPS), torch.log(distance / USUAL_RANGE)


def taken(values: Tensor, numbers: Tensor) -> Tensor:
    """Some of the values by their numbers, in the shape of these.

    It is ``values[numbers]``, in a form that onnxruntime computes a dozen times faster.
    """
    if numbers.ndim == 1:
        return values.gather(0, numbers)
    return values.gather(0, numbers.flatten()).reshape(numbers.shape)


def taken_of_each(rows: Tensor, numbers: Tensor) -> Tensor:
    """Some of the values of each row by their numbers (D,), as :func:`taken`: (R, D) of (R, S)."""
    return rows.gather(1, numbers.expand(rows.shape[0], -1))


def active(features: Tensor) -> Tensor:
    """Features after their activation."""
    return functional.leaky_relu(features, NEGATIVE_SLOPE)


def asinh(steps: Tensor) -> Tensor:
    """The inverse hyperbolic sine, by a logarithm: onnxruntime's own is many times slower."""
    size = steps.abs()
    return torch.sign(steps) * torch.log(size + (size * size + 1).sqrt())


def farther_by(distance: Tensor, dot: Tensor, apart: Tensor) -> Tensor:
    """Difference of ranges between neighbours: a difference of squares by the sum.

    The difference of two ranges would leave the rounding of both, which where beams lie close is no
    small part of a step.

    Args:
        distance: Ranges of the points, metres, float; of a shape that goes with the others'.
        dot: Products of the points with the offsets of their neighbours, float.
        apart: Their distances from the points, metres, float.

    Returns:
        Metres, float, in the shape of ``dot``.
    """
    squares = 2 * dot + apart * apart
    return squares / ((distance * distance + squares).clamp_min(0).sqrt() + distance)
