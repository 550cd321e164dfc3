"""Channels: values where a scan has them, and one stand-in where it has not."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from derain.evaluation.hard_cases import hard_cases
from derain.scan import Scan
from derain.views.channels import (
    DUAL_RETURN,
    INTENSITY_RANK,
    INTENSITY_RANKS,
    USUAL_CHANNELS,
    channel_image,
    channel_of,
    channel_values,
    extra_channels,
    filled_values,
    with_columns,
)

from ..two_returns import Recording

HARD_CASES = dict(hard_cases(largest=3000))
EVERYTHING = (*USUAL_CHANNELS, "radar", "doppler")


def test_extra_are_all_but_the_usual_in_their_order() -> None:
    assert extra_channels(["rcs", "x", "radar", "range", "ring", "intensity"]) == (
        "rcs",
        "radar",
        "ring",
    )
    assert extra_channels(USUAL_CHANNELS) == ()


@given(hnp.arrays(np.float64, st.integers(1, 20)), st.floats(-100, 100, width=32))
def test_each_value_is_the_scans_or_else_the_stand_in(
    column: NDArray[np.float64], mean: float
) -> None:
    scan = Scan(np.ones((len(column), 3), np.float32), fields={"doppler": column})
    rows = np.arange(len(column))[::-1]
    filled = filled_values(scan, rows, ["doppler"], {"doppler": mean})[:, 0]
    expected = [value if abs(value) <= 1e7 else mean for value in column[rows].tolist()]
    np.testing.assert_array_equal(filled, np.float32(expected))


def test_a_channel_without_a_stand_in_is_zero_where_it_is_missing() -> None:
    scan = Scan(np.full((2, 3), 4, np.float32))
    filled = filled_values(scan, np.array([1]), ["rcs", "y"], {"y": 7.0})
    assert filled.tolist() == [[0, 4]]


@pytest.mark.parametrize("scan", HARD_CASES.values(), ids=HARD_CASES)
def test_valid_points_of_a_hard_scan_have_finite_values(scan: Scan) -> None:
    rows = np.flatnonzero(scan.valid)
    filled = filled_values(scan, rows, EVERYTHING, {"intensity": 9.0})
    assert filled.shape == (len(rows), len(EVERYTHING))
    assert filled.dtype == np.float32
    assert np.isfinite(filled).all()
    # It is the scan's columns that are NaN, not what was made of them.
    absent = [scan.channel(name) is None for name in EVERYTHING]
    values = channel_values(scan, rows, EVERYTHING)
    np.testing.assert_array_equal(np.isnan(values).any(axis=1), np.array(absent) & (len(rows) > 0))


def test_the_scan_is_left_as_it_was() -> None:
    column = np.array([np.nan, 1], np.float32)
    scan = Scan(np.ones((2, 3), np.float32), fields={"rcs": column})
    filled_values(scan, np.arange(2), ["x", "rcs"], {"rcs": 5.0})[:] = 8
    assert np.isnan(column[0])
    assert scan.xyz.max() == 1


def test_columns_are_kept_by_name_and_all_others_left_behind() -> None:
    fields = {"RCS": np.arange(3), "time": np.arange(3), "doppler": np.array([1.0, np.inf, 3.0])}
    scan = Scan(np.ones((3, 3), np.float32), fields=fields, radar=np.array([True, False, True]))
    kept = with_columns(scan, ["doppler", "rcs", "snr"])
    assert set(kept.fields) == {"doppler", "rcs"}
    for name in ("doppler", "rcs", "snr", "radar"):
        np.testing.assert_equal(kept.channel(name), scan.channel(name))
    assert {column.dtype for column in kept.fields.values()} == {np.dtype(np.float32)}
    assert with_columns(scan, ()).fields == {}


def test_an_image_holds_the_values_of_its_winners_and_zero_where_there_is_none() -> None:
    columns = {"doppler": np.array([1.0, np.nan, 3.0])}
    scan = Scan(np.arange(9, dtype=np.float32).reshape(3, 3), fields=columns)
    winner = np.array([2, -1, 1, 0, 2, -1])
    image = channel_image(scan, winner, ["y", "doppler", "rcs"], {"doppler": -0.5, "rcs": 4.0})
    assert image.dtype == np.float32
    assert image.tolist() == [[7, 0, 4, 1, 7, 0], [3, 0, -0.5, 1, 3, 0], [4, 0, 4, 4, 4, 0]]


@pytest.mark.parametrize("scan", HARD_CASES.values(), ids=HARD_CASES)
def test_an_image_of_all_valid_points_holds_what_they_measure(scan: Scan) -> None:
    winner = np.where(scan.valid, np.arange(len(scan)), -1)
    image = channel_image(scan, winner, EVERYTHING, {"intensity": 9.0})
    filled = filled_values(scan, np.flatnonzero(scan.valid), EVERYTHING, {"intensity": 9.0}).T
    np.testing.assert_array_equal(image[:, scan.valid], filled)
    assert not image[:, ~scan.valid].any()


def test_the_place_of_a_return_in_its_ray_is_a_channel() -> None:
    recording = Recording(0)
    _, nearer, farther = recording.truth()
    expected = nearer.astype(np.float32) - farther.astype(np.float32)
    assert set(expected) == {-1, 0, 1}
    scan = Scan.of(recording.xyz)
    np.testing.assert_array_equal(channel_of(scan, DUAL_RETURN), expected)
    rows = np.arange(len(scan))
    np.testing.assert_array_equal(channel_values(scan, rows, [DUAL_RETURN])[0], expected)
    np.testing.assert_array_equal(filled_values(scan, rows, [DUAL_RETURN], {})[:, 0], expected)
    np.testing.assert_array_equal(channel_image(scan, rows, [DUAL_RETURN], {})[0], expected)


def test_a_scan_of_single_returns_has_no_place_of_them() -> None:
    scan = Scan.of(Recording(0, share=0).xyz)
    assert channel_of(scan, DUAL_RETURN) is None
    assert filled_values(scan, np.arange(5), [DUAL_RETURN], {DUAL_RETURN: 0.25}).max() == 0.25
    assert with_columns(scan, [DUAL_RETURN]).fields == {}


def test_places_of_returns_stay_with_them_when_points_are_taken_out_or_turned() -> None:
    scan = Scan.of(Recording(0).xyz)
    kept = with_columns(scan, [DUAL_RETURN])
    rows = np.random.default_rng(0).permutation(len(scan))[:100]
    part = replace(kept.take(rows), xyz=np.ones((100, 3), np.float32))
    expected = channel_of(scan, DUAL_RETURN)
    assert expected is not None
    np.testing.assert_array_equal(channel_of(part, DUAL_RETURN), expected[rows])


@given(
    hnp.arrays(np.uint8, st.integers(100, 300)).filter(lambda column: len(np.unique(column)) > 1),
    st.sampled_from([1 / 255, 1.0, 257.0]),
)
def test_ranks_of_intensity_keep_its_order_in_whatever_unit(
    column: NDArray[np.uint8], gain: float
) -> None:
    xyz = np.ones((len(column), 3), np.float32)
    rank = channel_of(Scan(xyz, intensity=column.astype(np.float32)), INTENSITY_RANK)
    scaled = channel_of(Scan(xyz, intensity=(column * gain).astype(np.float32)), INTENSITY_RANK)
    np.testing.assert_array_equal(rank, scaled)
    order = np.argsort(column, kind="stable")
    assert (np.diff(rank[order]) >= 0).all()
    assert rank[order[0]] == 0
    steps = rank * (INTENSITY_RANKS - 1)
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-5)


def test_ranks_tell_intensities_apart_where_most_points_share_one() -> None:
    intensity = np.repeat(np.arange(20, dtype=np.float32), [8000] + [100] * 19)
    scan = Scan(np.ones((len(intensity), 3), np.float32), intensity=intensity)
    rank = channel_of(scan, INTENSITY_RANK)
    assert len(np.unique(rank)) > 12


def test_without_measured_intensities_there_are_no_ranks() -> None:
    xyz = np.ones((200, 3), np.float32)
    assert channel_of(Scan(xyz), INTENSITY_RANK) is None
    assert channel_of(Scan(xyz, intensity=np.zeros(200, np.float32)), INTENSITY_RANK) is None
