"""The cue of brightness: counts against brute force, and silent where it knows nothing."""

import numpy as np
import torch
from hypothesis import given
from hypothesis import strategies as st

from derain.models.cues.brightness import FARTHEST, LARGEST, NEAREST, SHELLS, Histograms
from derain.views.channels import INTENSITY_RANKS


def drawn(seed: int, points: int = 500) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Logarithms of range, ranks and probabilities."""
    generator = np.random.default_rng(seed)
    log_range = np.log(generator.uniform(0.5, 90, points))
    rank = generator.integers(0, INTENSITY_RANKS, points) / (INTENSITY_RANKS - 1)
    probability = generator.uniform(0, 1, points)
    return torch.tensor(log_range), torch.tensor(rank), torch.tensor(probability)


@given(st.integers(0, 2**32 - 1))
def test_log_odds_are_those_of_smoothed_counts(seed: int) -> None:
    log_range, rank, probability = drawn(seed)
    rain, rest = np.zeros((2, SHELLS, INTENSITY_RANKS))
    edges = np.geomspace(NEAREST, FARTHEST, SHELLS + 1)[1:-1]
    for distance, level, p in zip(
        *(of.tolist() for of in (log_range.exp(), rank, probability)), strict=True
    ):
        cell = np.searchsorted(edges, distance), round(level * (INTENSITY_RANKS - 1))
        rain[cell] += p
        rest[cell] += 1 - p

    def smoothed(counts: np.ndarray) -> np.ndarray:
        for axis in (0, 1):
            padding = [(1, 1) if axis == number else (0, 0) for number in (0, 1)]
            wide = np.pad(counts, padding, mode="edge")
            take = [wide.take(range(n, n + counts.shape[axis]), axis) for n in range(3)]
            counts = 0.25 * take[0] + 0.5 * take[1] + 0.25 * take[2]
        return counts

    rain, rest = smoothed(rain), smoothed(rest)
    both = rain + rest + 1e-12
    usual = 100 * both / both.sum(1, keepdims=True)
    in_rain = (rain + usual) / (rain.sum(1, keepdims=True) + 100)
    in_rest = (rest + usual) / (rest.sum(1, keepdims=True) + 100)
    expected = np.log(in_rain / in_rest).clip(-LARGEST, LARGEST)
    found = Histograms(log_range, rank).brightness(torch.arange(len(rank)), probability)
    log_odds = found.log_odds.reshape(SHELLS, INTENSITY_RANKS).numpy()
    occurring = both > 0.1
    np.testing.assert_allclose(log_odds[occurring], expected[occurring], atol=1e-4)
    np.testing.assert_allclose(found.rain, rain.sum(1), rtol=1e-9)


def test_where_all_are_alike_or_none_is_rain_brightness_means_nothing() -> None:
    log_range, rank, probability = drawn(0)
    rows = torch.arange(len(rank))
    of_alike = Histograms(log_range, torch.zeros_like(rank))
    of_all = Histograms(log_range, rank)
    alike = of_alike.brightness(rows, probability)
    dry = of_all.brightness(rows, torch.zeros_like(probability))
    assert alike.log_odds[of_alike.cell].abs().max() < 1e-6
    assert dry.log_odds[of_all.cell].abs().max() < 1e-6


def test_points_that_are_not_asked_about_count_as_no_rain() -> None:
    log_range, rank, probability = drawn(1)
    rows = torch.arange(0, len(rank), 3)
    some = Histograms(log_range, rank).brightness(rows, probability[rows])
    others = torch.ones(len(rank), dtype=torch.bool).index_fill(0, rows, False)
    every = Histograms(log_range, rank).brightness(
        torch.arange(len(rank)), probability.masked_fill(others, 0)
    )
    torch.testing.assert_close(some.log_odds, every.log_odds)
