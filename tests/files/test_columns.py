"""A further column stands beside those that a scan has, also beside those of one from no file."""

from dataclasses import replace

import numpy as np
import pytest

from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.files.columns import columns_of, with_column
from derain.scan import Scan


def test_a_scan_from_no_file_keeps_its_coordinates_and_intensity() -> None:
    scan = Scan.of(scene(10))
    columns = columns_of(with_column(scan, "ring", np.arange(10)))
    assert list(columns) == ["x", "y", "z", "intensity", "ring"]
    np.testing.assert_array_equal(np.stack([columns[axis] for axis in "xyz"], axis=1), scan.xyz)
    assert scan.fields == {}


def test_a_column_of_the_same_name_is_replaced_in_its_place() -> None:
    points = scene(10)
    fields = dict(zip(("x", "ring", "y", "z"), points.T[[0, 3, 1, 2]], strict=True))
    scan = with_column(replace(Scan.of(points), fields=fields), "ring", np.arange(10))
    assert list(scan.fields) == ["x", "ring", "y", "z"]
    np.testing.assert_array_equal(scan.fields["ring"], np.arange(10))


def test_a_column_has_a_value_for_each_point() -> None:
    with pytest.raises(InputError, match="ring has 9 rows for 10 points"):
        with_column(Scan.of(scene(10)), "ring", np.arange(9))
