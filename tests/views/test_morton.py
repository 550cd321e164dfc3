"""Points along the curve, and some of them."""

import numpy as np
import pytest

from derain.views.morton import evenly


@pytest.mark.parametrize("rows", [0, 1, 9, 10, 11, 20, 99])
def test_some_of_the_rows_are_no_more_than_asked_and_equally_far_apart(rows) -> None:
    some = evenly(np.arange(rows), 10)
    assert len(some) <= 10
    assert len(some) > 5 or len(some) == rows
    assert len(set(np.diff(some))) <= 1
    assert not rows or some[0] == 0
