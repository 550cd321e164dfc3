"""Some of many are spread over all of them."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from derain.sources.spread import evenly_spaced


@given(st.integers(0, 60), st.integers(1, 20))
def test_items_are_spread_evenly_from_first_to_last(count: int, most: int) -> None:
    items = list(range(count))
    spaced = evenly_spaced(items, most)
    assert len(spaced) == min(count, most)
    steps = np.diff(spaced)
    assert (steps > 0).all()
    assert not len(steps) or steps.max() - steps.min() <= 1
    if count and most > 1:
        assert (spaced[0], spaced[-1]) == (0, count - 1)
