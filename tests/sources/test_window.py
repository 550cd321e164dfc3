"""A window is a number of scans before one and after it."""

import numpy as np
import pytest

from derain.errors import InputError
from derain.sources.window import Window


@pytest.mark.parametrize("wrong", [-1, 51, 1.5, "two", None])
@pytest.mark.parametrize("side", ["before", "after"])
def test_a_window_has_a_number_of_scans_that_memory_holds(side, wrong) -> None:
    with pytest.raises(InputError, match=rf"window: {side}: .* from 0 to 50"):
        Window(**{side: wrong})


def test_a_window_of_a_number_of_numpy_is_the_same_as_one_of_a_number() -> None:
    assert repr(Window(np.int64(1), np.uint8(2))) == repr(Window(1, 2))
