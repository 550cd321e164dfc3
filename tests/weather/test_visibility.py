"""Visibility is what is known of it: exact on laws, silent without rays, never better for rain."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from derain.weather.rays import BIN
from derain.weather.visibility import CLEAR_AIR, LOOK, SHARE_THROUGH, transmission, visibility_of

BINS = 40
counts = arrays(np.int64, BINS, elements=st.integers(0, 400))


def drawn(
    rate: float, rays: int, walls: tuple[float, float]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rays that meet drops at a rate per metre, in front of walls at some ranges."""
    generator = np.random.default_rng(0)
    drop, wall = generator.exponential(1 / rate, rays), generator.uniform(*walls, rays)
    place = np.minimum(np.minimum(drop, wall) / BIN, 99).astype(int)
    ends = drop < wall
    return np.bincount(place[~ends], minlength=100), np.bincount(place[ends], minlength=100)


@pytest.mark.parametrize("rate", [0.001, 0.005, 0.02, 0.1])
@pytest.mark.parametrize("walls", [(3, 30), (1, 12), (30, 40)])
def test_drops_at_a_rate_have_the_visibility_of_that_rate_wherever_the_walls_are(
    rate: float, walls: tuple[float, float]
) -> None:
    seen = visibility_of(*drawn(rate, 200_000, walls))
    assert seen.metres == pytest.approx(-math.log(SHARE_THROUGH) / rate, rel=0.1)
    assert seen.looked == LOOK
    assert seen.through == pytest.approx(math.exp(-rate * LOOK), abs=0.01)


@given(counts, counts)
def test_the_life_table_is_what_its_definition_says_bin_by_bin(
    other: NDArray[np.int64], rain: NDArray[np.int64]
) -> None:
    share, expected = 1.0, [1.0]
    for place in range(BINS):
        coming = other[place:].sum() + rain[place:].sum()
        if rain[place]:
            share *= 1 - rain[place] / (coming - other[place] / 2)
        expected.append(share)
    np.testing.assert_allclose(transmission(other, rain), expected, rtol=1e-9, atol=1e-12)


def test_the_life_table_is_the_estimate_of_kaplan_and_meier_but_for_its_bins() -> None:
    generator = np.random.default_rng(1)
    drop, wall = generator.weibull(1.5, 3000) * 12, generator.uniform(1, 18, 3000)
    end, met = np.minimum(drop, wall), drop < wall
    place = (end / BIN).astype(int)
    table = transmission(
        np.bincount(place[~met], minlength=40), np.bincount(place[met], minlength=40)
    )
    # Ray after ray, from the nearest end on: of those that come as far, each drop takes one away.
    coming = np.arange(3000, 0, -1)
    share = np.cumprod(1 - met[np.argsort(end)] / coming)
    ended = np.searchsorted(np.sort(end), BIN * np.arange(1, 33))  # before each bin's end
    np.testing.assert_allclose(table[1:33], share[ended - 1], atol=0.004)


@given(counts, counts, st.integers(0, BINS - 1))
def test_a_ray_more_that_meets_rain_makes_visibility_no_better(
    other: NDArray[np.int64], rain: NDArray[np.int64], place: int
) -> None:
    if other[place] == 0:
        return
    worse_other, worse_rain = other.copy(), rain.copy()
    worse_other[place] -= 1
    worse_rain[place] += 1
    before, after = visibility_of(other, rain), visibility_of(worse_other, worse_rain)
    assert after.at_least <= before.at_least * (1 + 1e-9)
    assert after.looked == before.looked


@given(counts, counts, st.integers(2, 5))
def test_the_same_scan_several_times_over_says_the_same_for_sure(
    other: NDArray[np.int64], rain: NDArray[np.int64], times: int
) -> None:
    once, often = visibility_of(other, rain), visibility_of(times * other, times * rain)
    assert often.looked >= once.looked
    if often.looked == once.looked and once.metres is not None:
        assert often.metres == pytest.approx(once.metres)


def test_clear_air_is_told_of_as_far_as_so_many_rays_can_tell() -> None:
    other = np.zeros(BINS, np.int64)
    other[30] = 100_000
    assert (visibility_of(other, 0 * other).metres, str(visibility_of(other, 0 * other))) == (
        None,
        "over 1,000 m",
    )
    # Of 300 rays, three may have met rain unseen: one in a hundred in 10 m.
    other[30] = 300
    few = visibility_of(other, 0 * other)
    assert few.metres is None
    assert few.at_least == pytest.approx(10 * math.log(0.9) / math.log(0.99))
    assert str(few) == "over 105 m"


def test_so_few_rays_say_nothing() -> None:
    other = np.zeros(BINS, np.int64)
    for rays in (0, 99):
        other[30] = rays
        seen = visibility_of(other, 0 * other)
        assert (seen.known, seen.metres, seen.at_least, seen.looked) == (False, None, 0, 0)
        assert str(seen) == "not known"


def test_nothing_but_rain_is_no_visibility() -> None:
    rain = np.zeros(BINS, np.int64)
    rain[4] = 1000
    seen = visibility_of(0 * rain, rain)
    assert (seen.metres, seen.at_least, seen.through, seen.known) == (0, 0, 0, True)
    assert str(seen) == "0.0 m"


def test_a_small_room_is_looked_at_as_far_as_it_goes() -> None:
    other, rain = np.zeros((2, BINS), np.int64)
    other[6], rain[1] = 950, 50
    seen = visibility_of(other, rain)
    assert seen.looked == 3.5
    assert seen.through == pytest.approx(0.95)
    assert seen.metres == pytest.approx(3.5 * math.log(0.9) / math.log(0.95))


@given(counts, counts)
def test_what_is_told_is_finite_and_in_bounds(
    other: NDArray[np.int64], rain: NDArray[np.int64]
) -> None:
    seen = visibility_of(other, rain)
    assert 0 <= seen.at_least <= CLEAR_AIR
    assert 0 <= seen.through <= 1
    assert seen.metres in (None, seen.at_least)
