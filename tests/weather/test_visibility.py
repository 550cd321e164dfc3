"""Visibility and reach: exact on laws, with intervals, not known without rays."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from derain.scan import Ints
from derain.weather.rays import BIN
from derain.weather.visibility import (
    CLEAR_AIR,
    NOT_KNOWN,
    SHARE_THROUGH,
    poisson_interval,
    reach_of,
    visibility_of,
)

BINS = 40
counts = arrays(np.int64, BINS, elements=st.integers(0, 400))


def drawn(rate: float, rays: int, walls: tuple[float, float]) -> tuple[Ints, Ints]:
    """Rays that meet drops at a rate per metre, in front of walls at some ranges."""
    generator = np.random.default_rng(0)
    drop, wall = generator.exponential(1 / rate, rays), generator.uniform(*walls, rays)
    place = np.minimum(np.minimum(drop, wall) / BIN, 99).astype(int)
    ends = drop < wall
    return np.bincount(place[~ends], minlength=100), np.bincount(place[ends], minlength=100)


@pytest.mark.parametrize(
    ("rate", "walls"), [(0.001, (1, 12)), (0.005, (3, 30)), (0.02, (30, 40)), (0.1, (1, 12))]
)
def test_drops_at_a_rate_have_the_visibility_of_that_rate_wherever_the_walls_are(
    rate, walls
) -> None:
    seen = visibility_of(*drawn(rate, 1_000_000, walls))
    assert seen.metres == pytest.approx(-math.log(SHARE_THROUGH) / rate, rel=0.03)
    assert seen.at_least <= seen.metres <= seen.at_most


@given(counts, counts, st.integers(0, BINS - 1))
def test_a_ray_more_that_meets_rain_makes_visibility_no_better(other, rain, place) -> None:
    if other[place] == 0:
        return
    worse_other, worse_rain = other.copy(), rain.copy()
    worse_other[place] -= 1
    worse_rain[place] += 1
    before, after = visibility_of(other, rain), visibility_of(worse_other, worse_rain)
    assert after.at_least <= before.at_least
    assert after.at_most <= before.at_most


@given(counts, counts, st.integers(2, 5))
def test_ends_enclose_the_estimate_and_the_more_rays_the_more_closely(other, rain, times) -> None:
    once, often = visibility_of(other, rain), visibility_of(times * other, times * rain)
    assert often.at_least >= once.at_least
    assert often.at_most <= once.at_most
    if once.metres is not None:
        assert often.metres == pytest.approx(once.metres)
    for seen in (once, reach_of(other + rain, 0.95)):
        assert 0 <= seen.at_least <= CLEAR_AIR
        assert seen.at_least <= seen.shown <= seen.at_most


def test_an_interval_is_that_of_a_poisson_count() -> None:
    """Of each end, the law has the count or what is beyond it with a chance of one in twenty."""

    def chance_up_to(most: int, mean: float) -> float:
        return sum(
            math.exp(number * math.log(mean) - mean - math.lgamma(number + 1))
            for number in range(most + 1)
        )

    assert poisson_interval(0)[0] == 0
    for count in (1, 3, 10, 100):
        least, most = poisson_interval(count)
        assert chance_up_to(count, most) == pytest.approx(0.05, abs=0.003)
        assert 1 - chance_up_to(count - 1, least) == pytest.approx(0.05, abs=0.015)


def test_clear_air_is_as_far_as_so_many_rays_can_show() -> None:
    other = np.zeros(BINS, np.int64)
    other[30] = 100_000
    clear = visibility_of(other, 0 * other)
    assert (clear.metres, clear.at_most, str(clear)) == (None, math.inf, "over 1,000 m")
    # Of 300 rays, three may have met rain unseen: one in a hundred in 10 m.
    other[30] = 300
    few = visibility_of(other, 0 * other)
    assert few.metres is None
    assert few.at_least == pytest.approx(-10 * math.log(0.9) / 0.01, rel=0.02)


def test_few_rays_show_nothing_and_nothing_but_rain_is_next_to_no_visibility() -> None:
    ends = np.zeros(BINS, np.int64)
    for rays in (0, 99):
        ends[4] = rays
        for seen in (visibility_of(ends, 0 * ends), reach_of(ends, 0.99)):
            assert seen == NOT_KNOWN
            assert (seen.known, str(seen)) == (False, "not known")
    ends[4] = 1000
    assert 0 < visibility_of(0 * ends, ends).at_most < 0.3


def test_reach_is_the_range_within_which_a_share_of_the_rays_end() -> None:
    ranges = np.random.default_rng(0).uniform(0, 19.4, 20_000)
    ending = np.bincount((ranges / BIN).astype(int), minlength=BINS)
    for share in (0.5, 0.95, 0.99):
        seen = reach_of(ending, share)
        assert seen.metres == pytest.approx(np.quantile(ranges, share), abs=0.05)
        assert seen.at_most - seen.at_least < 0.5
    ending = np.zeros(BINS, np.int64)
    ending[3], ending[-1] = 900, 100  # the last bin has no end
    beyond = reach_of(ending, 0.95)
    assert (beyond.metres, beyond.at_least, beyond.at_most) == (None, BIN * (BINS - 1), math.inf)
    ending[-1] = 0
    assert reach_of(ending // 9, 0.99).at_most == math.inf  # of few rays
    assert reach_of(ending, 0.99).at_most == pytest.approx(2, abs=0.01)
