"""The cue of geometry: how a point lies among its neighbours."""

import torch
from torch import Tensor, nn
from torch.nn import functional

from derain.models.layers.across_features import AcrossFeatures
from derain.models.layers.steps import (
    NEIGHBOUR_NUMBERS,
    SHELL_REACH,
    SHELLS,
    USUAL_RANGE,
    active,
)
from derain.views.isolated_points import SHELL_MIDDLES

# Added to what is divided by, which may be 0.
EPSILON = 1e-3


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
        opinion: What a point tells those that it is a neighbour of.
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
        self.register_buffer("centres", torch.linspace(*SHELLS)[:, None], persistent=False)
        middles = torch.from_numpy(SHELL_MIDDLES / USUAL_RANGE).log().float()
        self.register_buffer("middles", middles, persistent=False)

    def forward(
        self, seen: Tensor, far: Tensor, others: Tensor, counts: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Scores the S isolated points of a scan.

        Args:
            seen: Where their neighbours are, float (NEIGHBOUR_NUMBERS, k - 1, S), and ...
            far: ... logarithms of their ranges over the usual one, float (S,), as of
                :func:`~derain.models.cues.beams.in_steps`.
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
        """What the scan holds at the range of each point, and in all, over all of its points.

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
        """How much each logarithm of range belongs to each centre, float (centres, S)."""
        return torch.softmax(-(((far - self.centres) / SHELL_REACH) ** 2), dim=0)
