"""What is lowered right before the sensor."""

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch import Tensor

from derain.models.cues.carrier import OF_CARRIER, without_carrier
from derain.models.cues.geometry import USUAL_RANGE

# Logits of what is surely a drop, and of what is surely none.
DROP, NO_DROP = 8.0, -8.0


def lowered(before: Tensor, ranges: Tensor) -> Tensor:
    return without_carrier(before, torch.log(ranges / USUAL_RANGE), torch.tensor(len(before)))


def judged(near: int, beyond: int, others: int) -> tuple[Tensor, Tensor]:
    """Logits, before and after, of drops at 1 m, then of drops at 4 m, then of a wall at 20 m."""
    counts = torch.tensor([near, beyond, others])
    before = torch.tensor([DROP, DROP, NO_DROP]).repeat_interleave(counts)
    ranges = torch.tensor([1.0, 4.0, 20.0]).repeat_interleave(counts)
    return before, lowered(before, ranges)


@pytest.mark.parametrize("near", [5, 60, 3000])
def test_specks_right_before_the_sensor_are_no_drops_where_there_are_none_beyond(near) -> None:
    before, after = judged(near, 0, 100_000)
    assert (after[:near] < -DROP).all()
    torch.testing.assert_close(after[near:], before[near:])


@pytest.mark.parametrize("drops", [1, 20, 3000])
def test_near_drops_stay_where_as_many_are_beyond(drops) -> None:
    before, after = judged(drops, drops, 100_000)
    torch.testing.assert_close(after, before)


def test_dense_near_rain_stays_where_a_share_of_the_scan_is_rain_beyond() -> None:
    """More than .25 % of the scan are, however many more are near."""
    before, after = judged(20_000, 260, 80_000)
    torch.testing.assert_close(after, before)
    _, fewer = judged(20_000, 130, 80_000)
    assert (fewer[:20_000] < -DROP).all()


@given(st.lists(st.tuples(st.floats(-30, 30), st.floats(0.05, 200)), max_size=30))
def test_nothing_is_added_and_what_is_no_carrier_stays(points) -> None:
    before, ranges = torch.tensor(points).reshape(-1, 2).unbind(1)
    after = lowered(before, ranges)
    assert torch.isfinite(after).all()
    assert (after <= before).all()
    farther = ranges > 1.001 * OF_CARRIER
    torch.testing.assert_close(after[farther], before[farther], rtol=0, atol=0)
