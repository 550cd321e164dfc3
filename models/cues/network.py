"""The network: geometry, then brightness as the scan itself calibrates it, weighed together."""

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from derain.models.beam_steps import NEAREST_POINT, USUAL_RANGE, both_logits
from derain.models.carrier import without_carrier
from derain.models.cues.geometry import (
    AcrossFeatures,
    Geometry,
    in_steps,
    taken,
    taken_of_each,
)
from derain.views.intensity_rank import INTENSITY_RANKS

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
        without_intensity: Added to the log-odds of a rainy scan whose intensities are not known or
            all the same: geometry alone is less sure of rain than both cues are. Less is added to
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
        cues = Cues(far, cell, distances, neighbours, others, counts, doubtful)
        answers, features = [rain], taken_of_each(features, doubtful)
        for fusion in self.rounds:
            with torch.no_grad():
                given = cues.around(answers[-1])
            weighed = fusion(torch.cat([given, features]))[0]
            answers.append(rain.scatter(0, doubtful, weighed))
        size = counts.double().sum()
        if_unknown = self.without_intensity * (counts[:, 1:].sum() == 0).to(rain.dtype)
        answers = [answer + if_unknown * _raininess(answer, size) for answer in answers]
        return [*answers, without_carrier(answers[-1], far, size)]


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
    ) -> None:
        self._counts, self._doubtful = counts, doubtful
        self._cell_of_isolated = taken(cell, neighbours[0])
        self._cell = taken(self._cell_of_isolated, doubtful)
        around = slice(1, APART[-1] + 1)
        self._others = taken_of_each(others[around], doubtful)
        self._cell_of_others = taken(cell, taken_of_each(neighbours[around], doubtful))
        self._rank = self._cell % INTENSITY_RANKS
        self._rank_of_others = self._cell_of_others % INTENSITY_RANKS
        # Shifted and scaled, here and below, so that all numbers are of the order of 1.
        far = taken(far, doubtful)
        range_ = (USUAL_RANGE * far.exp()).clamp_min(NEAREST_POINT)
        apart = taken_of_each(distances[APART, :], doubtful) / range_
        rank = self._rank.to(far.dtype) / (INTENSITY_RANKS - 1)
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
        cell = self._cell_of_isolated
        first = calibrated(self._counts, cell, rain.sigmoid()).log_odds
        second = calibrated(self._counts, cell, (rain + SHARE_ADDED * taken(first, cell)).sigmoid())
        own = taken(rain, self._doubtful)
        of_all = torch.cat([rain, rain.new_full((1,), OF_CROWDED)])
        of_others = taken(of_all, self._others)
        brightness = taken(second.log_odds, self._cell_of_others)
        of_scan = torch.log1p(rain.sigmoid().double().sum()).to(rain.dtype)
        return torch.stack(
            [
                own / 4,
                taken(second.log_odds, self._cell) / 2,
                taken(first, self._cell) / 2,
                of_others.mean(dim=0) / 4,
                brightness.mean(dim=0) / 2,
                of_others.sigmoid().mean(dim=0),
                of_others.amax(dim=0) / 4,
                brightness.amax(dim=0) / 2,
                of_others.amin(dim=0) / 4,
                brightness.amin(dim=0) / 2,
                taken(_of_every_rank(torch.log1p(second.rain)), self._cell) / 4,
                taken(_of_every_rank(second.separation), self._cell),
                taken(_of_every_rank(second.share), self._cell),
                (of_scan / 4).expand_as(own),
                taken(second.at_any_range, self._rank) / 2,
                taken(second.at_any_range, self._rank_of_others).mean(dim=0) / 2,
                second.separation_at_any_range.expand_as(own),
                *self._places,
            ]
        )


@dataclass(frozen=True)
class Brightness:
    """The calibration of intensities in one scan.

    Attributes:
        log_odds: Log-odds of rain by shell and rank of intensity, 0 where that means nothing, float
            (SHELLS * INTENSITY_RANKS,).
        rain: Points of rain in each shell, float (SHELLS,).
        separation: How well intensity tells rain from the rest in each shell: the mean of the
            log-odds over its rain, float (SHELLS,).
        share: Share of rain in each shell, float (SHELLS,).
        at_any_range: Log-odds of rain by rank of intensity alone, over all shells, for shells that
            hold few drops; float (INTENSITY_RANKS,).
        separation_at_any_range: The mean of these over all rain, float ().
    """

    log_odds: Tensor
    rain: Tensor
    separation: Tensor
    share: Tensor
    at_any_range: Tensor
    separation_at_any_range: Tensor


def calibrated(counts: Tensor, cell: Tensor, probability: Tensor) -> Brightness:
    """Calibrates intensities by points that may be rain; all others are assumed not to be.

    How bright rain is depends on the sensor, and no training shows it. The scan does: where most of
    its points are judged well without intensity, histograms over them show how bright rain is here,
    at each range, and how bright the rest.

    Args:
        counts: Points of the scan by shell and rank, float (SHELLS, INTENSITY_RANKS).
        cell: Shell and rank of those that may be rain, int64 (S,).
        probability: Their probabilities of rain, float (S,).
    """
    # In float64, for sums of float32 over a whole scan differ from one runtime to another.
    rain = counts.new_zeros(counts.numel(), dtype=torch.float64)
    rain = _smoothed(rain.scatter_add(0, cell, probability.double()).reshape(counts.shape))
    rest = (_smoothed(counts.double()) - rain).clamp_min(0)
    log_odds, separation = _log_odds(rain, rest)
    at_any_range, separation_at_any_range = _log_odds(rain.sum(0)[None], rest.sum(0)[None])
    rain_in_shell = rain.sum(1)
    results = (
        log_odds.flatten(),
        rain_in_shell,
        separation,
        rain_in_shell / (rain_in_shell + rest.sum(1) + 1),
        at_any_range[0],
        separation_at_any_range[0],
    )
    return Brightness(*(result.to(probability.dtype) for result in results))


def _of_every_rank(of_shells: Tensor) -> Tensor:
    """One number of each shell, repeated for its ranks, float (SHELLS * INTENSITY_RANKS,).

    So that no cell has to be divided into shell and rank: runtimes that compute in bfloat16 divide
    whole numbers in it, too.
    """
    return of_shells[:, None].expand(-1, INTENSITY_RANKS).flatten()


def _log_odds(rain: Tensor, rest: Tensor) -> tuple[Tensor, Tensor]:
    """Log-odds of rain by rank of intensity, and their mean over the rain, of each shell.

    Args:
        rain: Points of rain by shell and rank, float (shells, INTENSITY_RANKS).
        rest: All other points, as ``rain``.

    Returns:
        Float (shells, INTENSITY_RANKS) and (shells,).
    """
    all_rain, all_rest = rain.sum(1, keepdim=True), rest.sum(1, keepdim=True)
    points = all_rain + all_rest
    usual = (rain + rest + LEAST_COUNT) / (points + LEAST_COUNT * INTENSITY_RANKS)
    of_rain = (rain + PSEUDO_POINTS * usual) / (all_rain + PSEUDO_POINTS)
    of_rest = (rest + PSEUDO_POINTS * usual) / (all_rest + PSEUDO_POINTS)
    log_odds = (of_rain.log() - of_rest.log()).clamp(-LARGEST_LOG_ODDS, LARGEST_LOG_ODDS)
    return log_odds, (of_rain * log_odds).sum(1)


def _smoothed(counts: Tensor) -> Tensor:
    """Counts by shell and rank with half of each spread to the four beside it; sums stay."""
    return _along(_along(counts).T).T


def _along(rows: Tensor) -> Tensor:
    """Each row with half of it spread to the rows beside it."""
    before = torch.cat([rows[:1], rows[:-1]])
    after = torch.cat([rows[1:], rows[-1:]])
    return 0.5 * rows + 0.25 * (before + after)
