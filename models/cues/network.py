"""The network: geometry, then brightness as the scan itself calibrates it, weighed together."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import torch
from torch import Tensor, nn

from derain.models.cues.carrier import without_carrier
from derain.models.cues.geometry import (
    NEAREST_POINT,
    USUAL_RANGE,
    AcrossFeatures,
    Geometry,
    in_steps,
    taken,
    taken_of_each,
)
from derain.views.intensity_rank import INTENSITY_RANKS
from derain.views.isolated_points import SHELLS

# Log-odds are cut to this either way; those of crowded neighbours are taken to be the second.
CERTAIN, OF_CROWDED = 12.0, -8.0

# Points of lower log-odds by geometry, that is of a probability below 1 in 150, keep its answer:
# hardly any of them is rain, and most points need not be weighed.
# Source: modelling choice.
DOUBTFUL = -5.0

# Numbers of the neighbours whose distances the fusion weighs; 0 is the point itself.
APART = (1, 3, 8)

# Distances below this share of the range are not told apart.
NEAREST_APART = 1e-4

# How much of the cue of brightness is added to calibrate it once more.
# Source: modelling choice, as are the two rounds.
SHARE_ADDED = 0.5
ROUNDS = 2

# Numbers of a point that a fusion weighs besides the features of geometry.
CUE_NUMBERS = 22

# Points that every shell is taken to hold besides its own, as bright as all of it: where few points
# are, or little rain, brightness means little.
# Source: modelling choice, as is the constant below.
PSEUDO_POINTS = 100.0

# Log-odds of brightness never exceed this, either way.
LARGEST_LOG_ODDS = 6.0

# How well intensity separates the rain of a scan from the rest where it means nothing, and where it
# counts whole. By chance alone, intensities that are drawn anew separate snow by .006 at most, its
# own by 1.8 or more. FEW_DROPS over their number is added, for few drops cannot show that it means
# nothing.
# Source: modelling choice.
MEANINGLESS, MEANINGFUL = 0.01, 0.02
FEW_DROPS = 5.0

# The least share of rain in a rainy scan; see ``without_intensity``.
# Source: modelling choice.
RAINY = 0.01

# Added to counts that others are divided by, or of which logarithms are taken.
LEAST_COUNT = 1e-6


class CueNetwork(nn.Module):
    """The network, from the isolated points of one scan to logits.

    A first pass sees geometry alone. Its probabilities calibrate the cue of brightness, and a
    fusion weighs both, of the point and of its neighbours. A second round does so again, from the
    answers of the first.

    Example:
        >>> seen = derain.CueFusion().view_for([])(derain.read_scan("scan.bin"))
        >>> inputs = {name: torch.from_numpy(array) for name, array in seen.inputs().items()}
        >>> derain.CueNetwork()(**inputs).shape == (seen.size, 2)
        True

    Args:
        neighbours: k, the size of a neighbourhood, the point itself included; at least 9.
        width: Features of a point.
        of_neighbour: Features of each neighbour, of where it is.
        opinion: Features that a point passes to the points that it is a neighbour of.
        context: Features of what a scan holds at some range.
        fusion: Features of a point in the two hidden layers of a fusion.
        without_intensity: Added to the log-odds of a rainy scan whose intensities are not known, or
            mean nothing: geometry alone is less sure of rain than both cues are. Less is added to
            scans of less rain, in proportion, so that a dry scan stays whole.
    """

    def __init__(
        self,
        neighbours: int = 9,
        width: int = 32,
        of_neighbour: int = 8,
        opinion: int = 12,
        context: int = 16,
        fusion: int = 64,
        without_intensity: float = 0.0,
    ) -> None:
        super().__init__()
        self.without_intensity = without_intensity
        self.geometry = Geometry(neighbours, width, of_neighbour, opinion, context)
        self.rounds = nn.ModuleList(_fusion(CUE_NUMBERS + width, fusion) for _ in range(ROUNDS))

    def forward(
        self,
        points: Tensor,
        cell: Tensor,
        distances: Tensor,
        neighbours: Tensor,
        step: Tensor,
        counts: Tensor,
    ) -> Tensor:
        """Scores every isolated point of a scan.

        Args:
            points: x, y, z in metres, in the sensor's frame, float (M, 3).
            cell: Shell and rank of intensity of each point, int64 (M,).
            distances: Distances to the neighbours in metres, float (S, k), ascending.
            neighbours: Of each isolated point itself, then its neighbours, as rows of ``points``,
                int64 (S, k).
            step: Angle between neighbouring beams, radians, float (1,).
            counts: Points of the scan by shell and rank, float (1, SHELLS, INTENSITY_RANKS).

        Returns:
            Logits of "not rain" and "rain", float (S, 2).
        """
        rain = self.answers(points, cell, distances, neighbours, step[0], counts[0])[-1]
        return both_logits(rain)

    def answers(
        self,
        points: Tensor,
        cell: Tensor,
        distances: Tensor,
        neighbours: Tensor,
        step: Tensor,
        counts: Tensor,
    ) -> Sequence[Tensor]:
        """Log-odds of rain by geometry, after each round, and as they are judged, float (S,) each.

        The last are those of the last round, lowered where points are likely of the sensor's
        carrier. Gradients do not pass from the cues to the answers that they come from. Arguments
        are as of :meth:`forward`, of one scan: step float (), counts float (SHELLS,
        INTENSITY_RANKS).
        """
        distances, neighbours = distances.T, neighbours.T
        seen, far = in_steps(points, distances, neighbours, step)
        others = _numbers(neighbours, points.shape[0])
        features, rain = self.geometry(seen, far, others, counts)
        doubtful = torch.nonzero(rain > DOUBTFUL)[:, 0]
        cues = Cues(far, cell, distances, neighbours, others, counts, doubtful, rain.detach())
        answers, features = [rain], taken_of_each(features, doubtful)
        for fusion in self.rounds:
            weighed = fusion(torch.cat([cues.around(answers[-1].detach()), features]))[0]
            answers.append(rain.scatter(0, doubtful, weighed))
        size = counts.double().sum()
        if_unknown = self.without_intensity * (1 - cues.meaning).to(rain.dtype)
        answers = [answer + if_unknown * _raininess(answer, size) for answer in answers]
        return [*answers, without_carrier(answers[-1], far, size)]


def both_logits(rain: Tensor) -> Tensor:
    """Logits of "not rain", which are 0, and of "rain", float (M, 2), of the latter, float (M,)."""
    return torch.stack([torch.zeros_like(rain), rain], dim=1)


def _raininess(rain: Tensor, size: Tensor) -> Tensor:
    """From 0 for a dry scan to 1 for a rainy one, by its log-odds of rain, float ().

    Args:
        rain: Log-odds of rain of the isolated points, float (S,).
        size: Number of all points of the scan, float64 ().
    """
    share = rain.sigmoid().double().sum() / size.clamp_min(1)
    return (share / RAINY).clamp(max=1).to(rain.dtype)


def _numbers(neighbours: Tensor, points: int) -> Tensor:
    """Neighbours as numbers of isolated points, S where they are crowded, int64 (k, S)."""
    isolated = neighbours[0]
    numbers = torch.full((points,), isolated.shape[0], device=isolated.device)
    numbers = numbers.scatter(0, isolated, torch.arange(isolated.shape[0], device=isolated.device))
    return taken(numbers, neighbours)


def _fusion(given: int, width: int) -> nn.Module:
    """Weighs the numbers of each point, float (given, D); log-odds of rain, float (1, D)."""
    return nn.Sequential(
        AcrossFeatures(given, width),
        nn.ReLU(),
        AcrossFeatures(width, width),
        nn.ReLU(),
        AcrossFeatures(width, 1),
    )


class Cues:
    """Cues of the points that geometry leaves in doubt, and of their neighbours.

    Args:
        far: Logarithms of the ranges of S isolated points, float (S,).
        cell: Shell and rank of intensity of M points, int64 (M,).
        distances: Distances to the neighbours, metres, float (k, S).
        neighbours: int64 (k, S), into the M points.
        others: The same as numbers of isolated points, S where they are crowded.
        counts: Points of the scan by shell and rank, float (SHELLS, INTENSITY_RANKS).
        doubtful: Isolated points that are weighed, int64 (D,).
        rain: Log-odds of rain by geometry, float (S,).

    Attributes:
        meaning: How much intensity counts, from 0 to 1: at 0 it does not separate rain from the
            rest, and the cues are those of a scan without intensities; float64 ().
    """

    def __init__(
        self,
        far: Tensor,
        cell: Tensor,
        distances: Tensor,
        neighbours: Tensor,
        others: Tensor,
        counts: Tensor,
        doubtful: Tensor,
        rain: Tensor,
    ) -> None:
        self._doubtful = doubtful
        self._cell_of_isolated = taken(cell, neighbours[0])
        self._calibration = Calibration(counts, self._cell_of_isolated)
        by_geometry = self._calibration(rain.clamp(-CERTAIN, CERTAIN).sigmoid())
        few = FEW_DROPS / by_geometry.rain[-1].sum().clamp_min(1)
        excess = by_geometry.separation[-1, 0] + few - MEANINGLESS
        differ = (counts[:, 1:].sum() > 0).double()
        self.meaning = differ * (excess / (MEANINGFUL - MEANINGLESS)).clamp(0, 1)
        self._cell = taken(self._cell_of_isolated, doubtful)
        around = slice(1, APART[-1] + 1)
        self._others = taken_of_each(others[around], doubtful)
        self._cell_of_others = taken(cell, taken_of_each(neighbours[around], doubtful))
        # Shifted and scaled, here and below, so that all numbers are of the order of 1.
        far = taken(far, doubtful)
        range_ = (USUAL_RANGE * far.exp()).clamp_min(NEAREST_POINT)
        apart = taken_of_each(distances[APART, :], doubtful) / range_
        rank = (self._cell % INTENSITY_RANKS).to(far.dtype) / (INTENSITY_RANKS - 1)
        rank = rank * self.meaning.to(far.dtype)
        self._places = torch.cat(
            [(far + 0.3)[None], torch.log(apart + NEAREST_APART) + 4, rank[None]]
        )

    def around(self, rain: Tensor) -> Tensor:
        """The cues of each doubtful point and of its neighbours, float (CUE_NUMBERS, D).

        Args:
            rain: Log-odds of rain of the isolated points, float (S,), which calibrate the cue of
                brightness.
        """
        rain = rain.clamp(-CERTAIN, CERTAIN)
        calibrated = self._calibration(rain.sigmoid(), self.meaning)
        first = calibrated.log_odds[:-1].flatten().to(rain.dtype)
        with_first = rain + SHARE_ADDED * taken(first, self._cell_of_isolated)
        by_cell = self._calibration(with_first.sigmoid(), self.meaning).by_cell().to(rain.dtype)
        brightness, of_scan, *of_shell, separation = taken_of_each(by_cell, self._cell).split(1)
        own = taken(rain, self._doubtful)[None]
        with_crowded = torch.cat([rain, rain.new_full((1,), OF_CROWDED)])
        others = taken(with_crowded, self._others)
        brightness_of_others = taken(by_cell[0], self._cell_of_others)
        of_scan_of_others = taken(by_cell[1], self._cell_of_others)
        drops = calibrated.rain[-1].sum().log1p().to(rain.dtype)
        return torch.cat(
            [
                own / 4,
                brightness,
                taken(first, self._cell)[None] / 2,
                others.mean(dim=0, keepdim=True) / 4,
                brightness_of_others.mean(dim=0, keepdim=True),
                others.sigmoid().mean(dim=0, keepdim=True),
                others.amax(dim=0, keepdim=True) / 4,
                brightness_of_others.amax(dim=0, keepdim=True),
                others.amin(dim=0, keepdim=True) / 4,
                brightness_of_others.amin(dim=0, keepdim=True),
                *of_shell,
                (drops / 4).expand_as(own),
                of_scan,
                of_scan_of_others.mean(dim=0, keepdim=True),
                separation,
                self._places,
            ]
        )


class Calibration:
    """Calibrates the intensities of one scan by points that may be rain.

    How bright rain is depends on the sensor, and no training shows it. The scan does: where most of
    its points are judged well without intensity, histograms over them show how bright rain is here,
    at each range, and how bright the rest.

    Args:
        counts: Points of the scan by shell and rank, float (SHELLS, INTENSITY_RANKS).
        cell: Shell and rank of those that may be rain, int64 (S,); all others are assumed not to
            be.
    """

    def __init__(self, counts: Tensor, cell: Tensor) -> None:
        self._cell = cell
        self._to_shells, self._to_ranks = (by.to(counts.device) for by in (TO_SHELLS, TO_RANKS))
        # In float64, for sums of float32 over a whole scan differ from one runtime to another.
        self._points = self._smoothed(counts.double())

    def __call__(self, probability: Tensor, meaning: Tensor | float = 1.0) -> "Brightness":
        """Histograms by the points' probabilities of rain.

        Args:
            probability: Float (S,).
            meaning: How much intensity counts, from 0 to 1, float64 ().
        """
        rain = self._points.new_zeros(SHELLS * INTENSITY_RANKS)
        rain = rain.scatter_add(0, self._cell, probability.double())
        rain = self._smoothed(rain.reshape(SHELLS, INTENSITY_RANKS))
        return Brightness(rain, (self._points - rain).clamp_min(0), meaning)

    def _smoothed(self, counts: Tensor) -> Tensor:
        """Half of each count spread to those beside it; the sum of all shells in the last row."""
        return self._to_shells @ counts @ self._to_ranks


def _spread(size: int) -> Tensor:
    """Spreads half of each of so many counts to the two beside it, float64 (size, size)."""
    beside = torch.diag(torch.full((size - 1,), 0.25, dtype=torch.float64), 1)
    beside = beside + beside.T
    return beside + torch.diag(1 - beside.sum(0))


TO_SHELLS = torch.cat([_spread(SHELLS), torch.ones(1, SHELLS, dtype=torch.float64)])
TO_RANKS = _spread(INTENSITY_RANKS)


@dataclass(frozen=True)
class Brightness:
    """Histograms of the rain of one scan, and of the rest of it.

    Attributes:
        rain: Points of rain by shell and rank of intensity, and in the last row those of all
            shells, float64 (SHELLS + 1, INTENSITY_RANKS).
        rest: All other points, as ``rain``.
        meaning: How much intensity counts, from 0 to 1, float64 ().
    """

    rain: Tensor
    rest: Tensor
    meaning: Tensor | float

    @cached_property
    def log_odds(self) -> Tensor:
        """Log-odds of rain, 0 where intensity means nothing, as ``rain``."""
        odds = self._share(self.rain).log() - self._share(self.rest).log()
        return self.meaning * odds.clamp(-LARGEST_LOG_ODDS, LARGEST_LOG_ODDS)

    @cached_property
    def separation(self) -> Tensor:
        """Relative entropy of rain's intensities to those of the rest, float64 (SHELLS + 1, 1)."""
        return (self._share(self.rain) * self.log_odds).sum(1, keepdim=True)

    def by_cell(self) -> Tensor:
        """What is known of each shell and rank together, float64 (6, SHELLS * INTENSITY_RANKS).

        Half of the log-odds of rain by shell and rank, and by rank alone, for shells that hold few
        drops; a quarter of the logarithm of the points of rain in the shell; how well intensity
        separates its rain from the rest; its share of rain; and how well intensity separates rain
        from the rest in the whole scan.
        """
        rain, rest = (each[:-1].sum(1, keepdim=True) for each in (self.rain, self.rest))
        numbers = torch.broadcast_tensors(
            self.log_odds[:-1] / 2,
            self.log_odds[-1:] / 2,
            rain.log1p() / 4,
            self.separation[:-1],
            rain / (rain + rest + 1),
            self.separation[-1:],
        )
        return torch.stack(numbers).flatten(1)

    @cached_property
    def _usual(self) -> Tensor:
        """Points as bright as all of each row, as ``rain``; see PSEUDO_POINTS."""
        points = self.rain + self.rest + LEAST_COUNT
        return PSEUDO_POINTS * points / points.sum(1, keepdim=True)

    def _share(self, counts: Tensor) -> Tensor:
        """Share of each row's points that each rank has, as ``rain``."""
        return (counts + self._usual) / (counts.sum(1, keepdim=True) + PSEUDO_POINTS)
