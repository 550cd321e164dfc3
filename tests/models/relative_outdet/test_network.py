"""What a point is told of its whole scan, and what is taken back right before the sensor."""

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch import Tensor

from derain.models.relative_outdet import RelativeOutDetNetwork
from derain.models.relative_outdet.network import OF_CARRIER, USUAL_RANGE, without_carrier
from derain.views.neighbour_search import NeighbourSearch

from .beams import sphere

# Logits of what is surely a drop, and of what is surely none.
DROP, NO_DROP = 8.0, -8.0


def logits(network: RelativeOutDetNetwork, xyz: np.ndarray) -> Tensor:
    neighbours, distances = NeighbourSearch(xyz, threads=1)(9)
    with torch.no_grad():
        scores: Tensor = network(*map(torch.from_numpy, (xyz, distances, neighbours)))
    return scores[:, 1]


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("context", [0, 16])
def test_the_rest_of_a_scan_matters_by_its_context_alone(seed: int, context: int) -> None:
    """What is four times as far off is no one's neighbour, and on beams of the same step."""
    torch.manual_seed(seed)
    network = RelativeOutDetNetwork(context=context).eval()
    here, there = (sphere(20, 40, 0.01, distance) for distance in (12.0, 48.0))
    alone = logits(network, here)
    among = logits(network, np.concatenate([here, there]))[: len(here)]
    if context:
        assert (alone - among).abs().min() > 1e-4  # of every point
    else:
        torch.testing.assert_close(alone, among)


def judged(near: int, beyond: int, others: int) -> tuple[Tensor, Tensor]:
    """Logits, before and after, of drops at 1 m, then of drops at 4 m, then of a wall at 20 m."""
    counts = torch.tensor([near, beyond, others])
    before = torch.tensor([DROP, DROP, NO_DROP]).repeat_interleave(counts)
    ranges = torch.tensor([1.0, 4.0, 20.0]).repeat_interleave(counts)
    return before, without_carrier(before, torch.log(ranges / USUAL_RANGE))


@pytest.mark.parametrize("near", [5, 60, 3000])
def test_specks_right_before_the_sensor_are_no_drops_where_there_are_none_beyond(near: int) -> None:
    before, after = judged(near, 0, 100_000)
    assert (after[:near] < -DROP).all()
    torch.testing.assert_close(after[near:], before[near:])


@pytest.mark.parametrize("drops", [1, 20, 3000])
def test_near_drops_stay_where_as_many_are_beyond(drops: int) -> None:
    before, after = judged(drops, drops, 100_000)
    torch.testing.assert_close(after, before)


def test_dense_near_rain_stays_where_a_share_of_the_scan_is_rain_beyond() -> None:
    """More than .25 % of the scan are, however many more are near."""
    before, after = judged(20_000, 260, 80_000)
    torch.testing.assert_close(after, before)
    _, fewer = judged(20_000, 130, 80_000)
    assert (fewer[:20_000] < -DROP).all()


@given(st.lists(st.tuples(st.floats(-30, 30), st.floats(0.05, 200)), max_size=30))
def test_nothing_is_added_and_what_is_no_carrier_stays(points: list[tuple[float, float]]) -> None:
    before, ranges = torch.tensor(points).reshape(-1, 2).unbind(1)
    after = without_carrier(before, torch.log(ranges / USUAL_RANGE))
    assert torch.isfinite(after).all()
    assert (after <= before).all()
    farther = ranges > 1.001 * OF_CARRIER
    torch.testing.assert_close(after[farther], before[farther], rtol=0, atol=0)
