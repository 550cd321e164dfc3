"""The cue of brightness: what a scan's own rain looks like, by the scan itself.

How rain differs from the rest in intensity hangs on the sensor, and no training knows it. The scan
does: where most of its points are judged well without intensity, histograms over them show how
bright rain is here, at each range, and how bright the rest.
"""

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from derain.views.channels import INTENSITY_RANKS

# Shells around the sensor, in which rain and the rest are counted apart: equal steps of the
# logarithm of range between these, metres. What is nearer is counted in the first, what is farther
# in the last.
# Source: modelling choice, as are the two constants below.
SHELLS, NEAREST, FARTHEST = 11, 1.0, 60.0

# Points that every shell is taken to hold besides its own, as bright as all of it: where few points
# are, or little rain, brightness means little.
PSEUDO_POINTS = 100.0

# Added to counts that others are divided by, or of which logarithms are taken.
LEAST = 1e-6

# Log-odds of brightness never exceed this, either way.
LARGEST = 6.0


@dataclass(frozen=True)
class Brightness:
    """What intensities mean in one scan.

    Attributes:
        log_odds: Log-odds of rain by shell and rank of intensity, 0 where that means nothing, float
            (SHELLS * INTENSITY_RANKS,).
        rain: Points of rain in each shell, float (SHELLS,).
        separation: How well intensity tells rain from the rest in each shell: the mean of the
            log-odds over its rain, float (SHELLS,).
        share: Share of rain in each shell, float (SHELLS,).
    """

    log_odds: Tensor
    rain: Tensor
    separation: Tensor
    share: Tensor


class Histograms:
    """Counts the points of a scan by range and by rank of intensity.

    Args:
        log_range: Logarithms of the points' ranges in metres, float (M,).
        rank: Rank of their intensity among the scan's, from 0 to 1, float (M,).

    Attributes:
        shell: Number of the shell that each point is in, int64 (M,).
        cell: Number of its shell and rank together, int64 (M,).
    """

    def __init__(self, log_range: Tensor, rank: Tensor) -> None:
        step = math.log(FARTHEST / NEAREST) / SHELLS
        self.shell = ((log_range - math.log(NEAREST)) / step).floor().clamp(0, SHELLS - 1).long()
        rank = (rank * (INTENSITY_RANKS - 1)).round().clamp(0, INTENSITY_RANKS - 1).long()
        self.cell = self.shell * INTENSITY_RANKS + rank
        self._points = _counted(self.cell, torch.ones_like(log_range))

    def brightness(self, rows: Tensor, probability: Tensor) -> Brightness:
        """What intensities mean, by points that may be rain; the others are taken not to be.

        Args:
            rows: Rows of the points that may be rain, int64 (S,).
            probability: How probably each is, float (S,).
        """
        rain = _counted(self.cell[rows], probability)
        rest = (self._points - rain).clamp_min(0)
        rain_in_shell, rest_in_shell = rain.sum(1, keepdim=True), rest.sum(1, keepdim=True)
        in_shell = rain_in_shell + rest_in_shell
        usual = (rain + rest + LEAST) / (in_shell + LEAST * INTENSITY_RANKS)
        of_rain = (rain + PSEUDO_POINTS * usual) / (rain_in_shell + PSEUDO_POINTS)
        of_rest = (rest + PSEUDO_POINTS * usual) / (rest_in_shell + PSEUDO_POINTS)
        log_odds = (of_rain.log() - of_rest.log()).clamp(-LARGEST, LARGEST)
        results = (
            log_odds.flatten(),
            rain_in_shell[:, 0],
            (of_rain * log_odds).sum(1),
            (rain_in_shell / (in_shell + 1))[:, 0],
        )
        return Brightness(*(result.to(probability.dtype) for result in results))


def _counted(cell: Tensor, weight: Tensor) -> Tensor:
    """Sums of points' weights, smoothed, by shell and rank, double (SHELLS, INTENSITY_RANKS)."""
    # In float64, for sums of float32 over a whole scan differ from one runtime to another.
    sums = torch.zeros(SHELLS * INTENSITY_RANKS, dtype=torch.float64, device=weight.device)
    sums = sums.scatter_add(0, cell, weight.double()).reshape(SHELLS, INTENSITY_RANKS)
    return _smoothed(_smoothed(sums).T).T


def _smoothed(rows: Tensor) -> Tensor:
    """Each row with half of it spread to the rows beside it; sums stay."""
    before = torch.cat([rows[:1], rows[:-1]])
    after = torch.cat([rows[1:], rows[-1:]])
    return 0.5 * rows + 0.25 * (before + after)
