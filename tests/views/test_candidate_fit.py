"""Fitted candidates hold the rain that was asked for, and leave out what can be left out."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derain.errors import InputError
from derain.scan import Bools, Scan
from derain.views.candidate_fit import WORTH, fit_candidates

CHANNELS = ("x", "y", "z", "intensity")


def street(points: int, seed: int, drops: float = 0.2) -> tuple[Scan, Bools]:
    """A scan whose rain is near, high and dim, but for a few drops that may be anywhere."""
    generator = np.random.default_rng(seed)
    rain = generator.random(points) < drops
    distance = np.where(rain, generator.exponential(5, points), generator.uniform(2, 80, points))
    azimuth = generator.uniform(-np.pi, np.pi, points)
    height = np.where(rain, generator.normal(1, 0.5, points), generator.uniform(-2, 3, points))
    intensity = np.where(rain, generator.exponential(2, points), generator.uniform(0, 200, points))
    xyz = np.stack([distance * np.cos(azimuth), distance * np.sin(azimuth), height], axis=1)
    return Scan.of(np.column_stack([xyz, intensity])), rain


@given(
    st.lists(st.tuples(st.integers(1, 2000), st.integers(0, 99)), min_size=1, max_size=3),
    st.sampled_from([0.5, 0.9, 0.99, 0.999]),
)
def test_candidates_hold_at_least_the_rain_that_was_asked_for(sizes, inside) -> None:
    scans = [street(points, seed) for points, seed in sizes]
    candidates = fit_candidates(scans, CHANNELS, inside)
    if candidates is None:
        return
    among = np.concatenate([candidates.among(scan) for scan, _ in scans])
    rain = np.concatenate([rain for _, rain in scans])
    assert among[rain].mean() >= inside
    assert among.mean() <= 1 - WORTH
    assert candidates.points == pytest.approx(among.mean())
    assert candidates.rain == pytest.approx(among[rain].mean())
    assert candidates.rain_share == pytest.approx(rain[among].mean())


def test_a_margin_keeps_rain_of_other_scans_inside() -> None:
    candidates = fit_candidates([street(50_000, 1)], CHANNELS, 0.99)
    assert {bound.channel for bound in candidates.bounds} == {"range", "z", "intensity"}
    scan, rain = street(200_000, 2)
    # Tails that fall exponentially leave out a tenth of the hundredth that was allowed.
    assert 1 - candidates.among(scan)[rain].mean() == pytest.approx(0.001, abs=0.0005)


@pytest.mark.parametrize("points", [250, 1000, 4000])
def test_little_rain_makes_the_bounds_wider_than_its_outermost_drops(points) -> None:
    other, rain = street(50_000, 0)
    outside = []
    for seed in range(1, 21):
        candidates = fit_candidates([street(points, seed)], CHANNELS, 0.999)
        if candidates is not None:
            outside.append(1 - candidates.among(other)[rain].mean())
    assert len(outside) == 20
    assert np.mean(outside) < 0.002


def test_too_few_drops_to_show_a_tail_give_no_bound() -> None:
    scan, _ = street(5000, 9)
    nine = np.arange(5000) < 9
    assert fit_candidates([(scan, nine)], CHANNELS) is None


def test_the_bounds_follow_the_unit_of_the_data() -> None:
    (scan, rain) = street(20_000, 3)
    of_bytes = fit_candidates([(scan, rain)], CHANNELS)
    of_shares = fit_candidates([(scan.with_intensity_times(1 / 255), rain)], CHANNELS)
    brightest = [
        next(bound.most for bound in fitted.bounds if bound.channel == "intensity")
        for fitted in (of_bytes, of_shares)
    ]
    assert brightest[0] == pytest.approx(255 * brightest[1], rel=0.02)


def test_intensity_has_no_bound_where_the_network_or_the_scan_has_none() -> None:
    scan, rain = street(5000, 4)
    for seen, channels in ((scan, ("x", "y", "z")), (Scan(scan.xyz), CHANNELS)):
        fitted = fit_candidates([(seen, rain)], channels)
        assert {bound.channel for bound in fitted.bounds} == {"range", "z"}


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_where_rain_is_as_the_rest_is_or_is_not_there_are_no_bounds(share) -> None:
    scan, _ = street(5000, 6)
    anywhere = np.random.default_rng(7).random(5000) < share
    assert fit_candidates([(scan, anywhere)], CHANNELS) is None
    assert fit_candidates([], CHANNELS) is None


@pytest.mark.parametrize("inside", [0.0, 0.4, 1.0, 1.5, float("nan")])
def test_a_share_that_is_none_is_refused(inside) -> None:
    with pytest.raises(InputError, match="is no share of the rain"):
        fit_candidates([street(100, 8)], CHANNELS, inside)
