"""The cue of brightness: what a scan's own rain looks like, by the scan itself.

How rain differs from the rest in intensity hangs on the sensor, and no training knows it. The scan
does: where most of its points are judged well without intensity, histograms over them show how
bright rain is here, at each range, and how bright the rest.
"""

from dataclasses import dataclass

import torch
from torch import Tensor

from derain.views.intensity_rank import INTENSITY_RANKS

# Points that every shell is taken to hold besides its own, as bright as all of it: where few points
# are, or little rain, brightness means little.
# Source: modelling choice, as is the constant below.
PSEUDO_POINTS = 100.0

# Log-odds of brightness never exceed this, either way.
LARGEST = 6.0

# Added to counts that others are divided by, or of which logarithms are taken.
LEAST = 1e-6


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


def calibrated(counts: Tensor, cell: Tensor, probability: Tensor) -> Brightness:
    """What intensities mean, by points that may be rain; the others are taken not to be.

    Args:
        counts: Points of the scan by shell and rank, float (SHELLS, INTENSITY_RANKS).
        cell: Shell and rank of those that may be rain, int64 (S,).
        probability: How probably each is, float (S,).
    """
    # In float64, for sums of float32 over a whole scan differ from one runtime to another.
    rain = counts.new_zeros(counts.numel(), dtype=torch.float64)
    rain = _smoothed(rain.scatter_add(0, cell, probability.double()).reshape(counts.shape))
    rest = (_smoothed(counts.double()) - rain).clamp_min(0)
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


def _smoothed(counts: Tensor) -> Tensor:
    """Counts by shell and rank with half of each spread to the four beside it; sums stay."""
    return _along(_along(counts).T).T


def _along(rows: Tensor) -> Tensor:
    """Each row with half of it spread to the rows beside it."""
    before = torch.cat([rows[:1], rows[:-1]])
    after = torch.cat([rows[1:], rows[-1:]])
    return 0.5 * rows + 0.25 * (before + after)
