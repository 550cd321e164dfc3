"""Statistics of training scans are those of all their valid points."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derain.cards.card import DataCard
from derain.datamodules.base import with_statistics
from derain.errors import InputError
from derain.evaluation.hard_cases import hard_cases
from derain.scan import Scan

CARD = DataCard("ours", {0: "ground", 3: "rain", 4: "spray"}, rain=(3, 4))
USUAL = ("x", "y", "z", "intensity")


def mean_and_std(card: DataCard) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Means, and standard deviations, of x, y, z and intensity."""
    mean, std = zip(*(card.statistics(name) for name in USUAL), strict=True)
    return mean, std


def random_scan(seed: int, points: int) -> Scan:
    rng = np.random.default_rng(seed)
    columns = rng.normal([10, -5, 1, 40], [20, 10, 2, 30], (points, 4))
    columns[rng.random(points) < 0.2] = np.nan
    return Scan.of(columns).with_label(rng.choice([0, 3, 4], points))


@given(st.lists(st.tuples(st.integers(0, 2**32), st.integers(0, 50)), min_size=1, max_size=5))
def test_they_are_numpys_over_all_points_at_once(scans) -> None:
    drawn = [random_scan(seed, points) for seed, points in scans]
    columns = np.concatenate([np.c_[s.xyz, s.intensity, s.label][s.valid] for s in drawn])
    card = with_statistics(CARD, iter(drawn))
    # One row, however often: a channel that never changes is the next test's.
    if len(np.unique(columns, axis=0)) < 2:
        return
    mean, std = mean_and_std(card)
    np.testing.assert_allclose(mean, columns[:, :4].mean(axis=0), rtol=1e-6)
    np.testing.assert_allclose(std, columns[:, :4].std(axis=0), rtol=1e-5)
    distance = np.linalg.norm(columns[:, :3], axis=1)
    np.testing.assert_allclose(
        card.statistics("range"), (distance.mean(), distance.std()), rtol=1e-5
    )
    assert card.rain_share == pytest.approx((columns[:, 4] > 0).mean())
    assert (card.name, card.classes, card.rain) == (CARD.name, CARD.classes, CARD.rain)


def test_a_channel_that_never_changes_but_for_rounding_is_divided_by_one() -> None:
    points = np.array([[1.0, 2, 3, 7], [4, 2, 3, 7], [7, 2, 3, 7]])
    card = with_statistics(CARD, [Scan.of(points).with_label(np.zeros(3, np.int64))])
    assert mean_and_std(card) == ((4, 2, 3, 7), (pytest.approx(math.sqrt(6)), 1, 1, 1))
    assert card.rain_share == 0
    points = np.random.default_rng(0).normal(size=(9999, 4)).astype(np.float32)
    points[:, 3] = 0.1
    assert with_statistics(CARD, [Scan.of(points)]).statistics("intensity")[1] == 1


def test_extra_channels_are_measured_over_the_numbers_of_valid_points() -> None:
    rng = np.random.default_rng(0)
    scans, doppler, flags = [], [], []
    for size in (40, 0, 70):
        scan = random_scan(size, size)
        column = np.where(rng.random(size) < 0.7, np.nan, rng.normal(3, 2, size))
        column[:1] = np.inf
        radar = rng.random(size) < 0.3
        scans.append(Scan(scan.xyz, scan.intensity, radar=radar, fields={"doppler": column}))
        doppler.append(column[scan.valid & np.isfinite(column)])
        flags.append(radar[scan.valid])
    scans.append(random_scan(1, 30))  # has neither, and counts for neither
    card = with_statistics(CARD, iter(scans), ["doppler", "radar"])
    for name, values in (("doppler", doppler), ("radar", flags)):
        expected = np.concatenate(values)
        measured = card.statistics(name)
        np.testing.assert_allclose(measured, (expected.mean(), expected.std()), rtol=1e-5)
    usual = with_statistics(CARD, iter(scans)).moments
    assert usual.keys() == {*USUAL, "range"}
    assert {name: card.moments[name] for name in usual} == usual


def test_scans_without_intensity_do_not_count_for_it() -> None:
    scan = random_scan(1, 50)
    bare = Scan(random_scan(2, 50).xyz)
    both, alone, without = (
        with_statistics(CARD, scans).statistics("intensity")
        for scans in ([scan, bare], [scan], [bare])
    )
    assert both == alone
    assert without == (0, 1)


def test_a_channel_of_which_no_scan_holds_a_number_is_refused() -> None:
    nothing = Scan(np.ones((3, 3), np.float32), fields={"doppler": np.full(3, np.nan)})
    for name in ("doppler", "dopler"):
        with pytest.raises(InputError, match=f"channel '{name}': no training scan has"):
            with_statistics(CARD, [nothing], [name])


def test_hard_scans_give_statistics_that_can_be_divided_by() -> None:
    assert set(with_statistics(CARD, []).moments.values()) == {(0.0, 1.0)}
    for name, scan in hard_cases(largest=1000):
        card = with_statistics(CARD, [scan.with_label(np.full(len(scan), 3))])
        assert card.has_statistics, name
        assert np.isfinite([*card.moments.values()]).all(), name
        assert min(std for _, std in card.moments.values()) > 0, name
        assert card.rain_share == (1 if scan.valid.any() else 0), name


def test_scans_without_labels_give_all_but_the_share_of_rain() -> None:
    scan = random_scan(1, 50)
    card, unlabelled = (
        with_statistics(CARD, [scan]),
        with_statistics(CARD, [Scan(scan.xyz, scan.intensity)]),
    )
    assert unlabelled.rain_share is None
    assert unlabelled.completed({}, card.rain_share) == card


def test_what_a_card_states_is_not_measured_again() -> None:
    card = CARD.completed({"x": (1.0, 2.0)}, rain_share=0.5)
    complete = with_statistics(card, [random_scan(1, 50)])
    assert (complete.statistics("x"), complete.rain_share) == ((1.0, 2.0), 0.5)
    measured = with_statistics(CARD, [random_scan(1, 50)])
    assert complete.statistics("y") == measured.statistics("y")
