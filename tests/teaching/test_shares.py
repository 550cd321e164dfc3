"""Shares of a teacher's answers, by range."""

import numpy as np

from derain.scan import Scan
from derain.teaching.shares import TaughtShares


def test_points_are_counted_by_range_and_answer() -> None:
    points = np.zeros((7, 4))
    points[:, 0] = [1, 9.5, 10, 39, 40, 80, np.nan]
    labels = np.array([0, 1, 1, 255, 0, 255, 255], np.uint32)
    shares = TaughtShares()
    np.testing.assert_allclose(shares.add(Scan.of(points), labels), [2 / 6, 2 / 6, 2 / 6])
    expected = [[1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 0], [0, 0, 1]]
    np.testing.assert_array_equal(shares.table, expected)
    shares.add(Scan.of(points), labels)
    np.testing.assert_array_equal(shares.table, 2 * np.array(expected))
    assert shares.rain == 4
    lines = str(shares).splitlines()
    assert lines[1].split() == ["0-10", "m", "4", "50.0%", "50.0%", "0.0%"]
    assert lines[-1].split() == ["all", "12", "33.3%", "33.3%", "33.3%"]


def test_a_scan_without_points_has_no_shares() -> None:
    shares = TaughtShares()
    assert np.isnan(shares.add(Scan.of(np.zeros((0, 4))), np.zeros(0, np.uint32))).all()
    assert str(shares).splitlines()[-1].split() == ["all", "0", "-", "-", "-"]
