"""The cue of brightness: counts against brute force, and silent where it knows nothing."""

import numpy as np
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch import Tensor

from derain.models.cues.network import LARGEST_LOG_ODDS, calibrated
from derain.views.intensity_rank import INTENSITY_RANKS
from derain.views.isolated_points import SHELLS


def drawn(seed: int, points: int = 500) -> tuple[Tensor, Tensor, Tensor]:
    """Points by shell and rank, the cell of each of them, and how probably it is rain."""
    generator = np.random.default_rng(seed)
    cell = torch.tensor(generator.integers(0, SHELLS * INTENSITY_RANKS, points))
    return counted(cell), cell, torch.tensor(generator.uniform(0, 1, points))


def counted(cell: Tensor) -> Tensor:
    counts = torch.bincount(cell, minlength=SHELLS * INTENSITY_RANKS)
    return counts.reshape(SHELLS, INTENSITY_RANKS).float()


def smoothed(counts: np.ndarray) -> np.ndarray:
    for axis in (0, 1):
        padding = [(1, 1) if axis == number else (0, 0) for number in (0, 1)]
        wide = np.pad(counts, padding, mode="edge")
        take = [wide.take(range(n, n + counts.shape[axis]), axis) for n in range(3)]
        counts = 0.25 * take[0] + 0.5 * take[1] + 0.25 * take[2]
    return counts


@given(st.integers(0, 2**32 - 1))
def test_log_odds_are_those_of_smoothed_counts(seed: int) -> None:
    counts, cell, probability = drawn(seed)
    rain, rest = np.zeros((2, SHELLS, INTENSITY_RANKS))
    for number, p in zip(cell.tolist(), probability.tolist(), strict=True):
        place = divmod(number, INTENSITY_RANKS)
        rain[place] += p
        rest[place] += 1 - p
    rain, rest = smoothed(rain), smoothed(rest)
    both = rain + rest + 1e-12
    usual = 100 * both / both.sum(1, keepdims=True)
    in_rain = (rain + usual) / (rain.sum(1, keepdims=True) + 100)
    in_rest = (rest + usual) / (rest.sum(1, keepdims=True) + 100)
    expected = np.log(in_rain / in_rest).clip(-LARGEST_LOG_ODDS, LARGEST_LOG_ODDS)
    found = calibrated(counts, cell, probability)
    log_odds = found.log_odds.reshape(SHELLS, INTENSITY_RANKS).numpy()
    occurring = both > 0.1
    np.testing.assert_allclose(log_odds[occurring], expected[occurring], atol=1e-4)
    np.testing.assert_allclose(found.rain, rain.sum(1), rtol=1e-9)


def test_where_all_are_alike_or_none_is_rain_brightness_means_nothing() -> None:
    counts, cell, probability = drawn(0)
    darkest = cell - cell % INTENSITY_RANKS
    alike = calibrated(counted(darkest), darkest, probability)
    dry = calibrated(counts, cell, torch.zeros_like(probability))
    assert alike.log_odds[darkest].abs().max() < 1e-6
    assert dry.log_odds[cell].abs().max() < 1e-6


def test_points_that_are_not_asked_about_count_as_no_rain() -> None:
    counts, cell, probability = drawn(1)
    asked = torch.arange(len(cell)) % 3 == 0
    some = calibrated(counts, cell[asked], probability[asked])
    every = calibrated(counts, cell, probability * asked)
    torch.testing.assert_close(some.log_odds, every.log_odds)
