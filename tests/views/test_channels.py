"""Channels: values where a scan has them, and one stand-in where it has not."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from derain.evaluation.hard_cases import hard_cases
from derain.scan import Scan
from derain.views.channels import (
    USUAL_CHANNELS,
    channel_image,
    channel_values,
    extra_channels,
    filled_values,
    with_columns,
)

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
def test_each_value_is_the_scans_or_else_the_stand_in(column, mean) -> None:
    scan = Scan(np.ones((len(column), 3), np.float32), fields={"doppler": column})
    rows = np.arange(len(column))[::-1]
    filled = filled_values(scan, rows, ["doppler"], {"doppler": mean})[:, 0]
    expected = [value if abs(value) <= 1e7 else mean for value in column[rows].tolist()]
    np.testing.assert_array_equal(filled, np.float32(expected))


def test_channels_keep_their_order_and_one_without_a_stand_in_is_zero_where_it_is_missing() -> None:
    scan = Scan(np.arange(6, dtype=np.float32).reshape(2, 3))
    filled = filled_values(scan, np.array([1]), ["y", "rcs", "x"], {"y": 7.0})
    assert filled.tolist() == [[4, 0, 3]]


@pytest.mark.parametrize("scan", HARD_CASES.values(), ids=HARD_CASES)
def test_valid_points_of_a_hard_scan_have_finite_values(scan) -> None:
    rows = np.flatnonzero(scan.valid)
    filled = filled_values(scan, rows, EVERYTHING, {"intensity": 9.0})
    assert filled.shape == (len(rows), len(EVERYTHING))
    assert filled.dtype == np.float32
    assert np.isfinite(filled).all()
    # It is the scan's columns that are NaN, not what was made of them.
    absent = [scan.channel(name) is None for name in EVERYTHING]
    values = channel_values(scan, rows, EVERYTHING)
    np.testing.assert_array_equal(np.isnan(values).any(axis=1), np.array(absent) & (len(rows) > 0))


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
