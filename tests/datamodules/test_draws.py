"""What an epoch draws from several data sets: by weight, and of each all scans equally often."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derain.datamodules.order import Draws, Pick, TrainingOrder, shared_out
from derain.errors import InputError

WEIGHTS = st.lists(st.floats(0.1, 10), min_size=1, max_size=5)
SIZES = st.lists(st.integers(1, 12), min_size=1, max_size=4)


def sampler(draws: Draws, seed: int, processes: int, process: int) -> TrainingOrder:
    return TrainingOrder(range(sum(draws.scans)), seed, processes, process, draws)


def order(draws: Draws, processes: int, epoch: int, seed: int = 0) -> list[list[Pick]]:
    """What each process reads in an epoch."""
    samplers = [sampler(draws, seed, processes, own) for own in range(processes)]
    for one in samplers:
        one.set_epoch(epoch)
        assert len(one) == len(list(one))
    return [list(one) for one in samplers]


@given(st.integers(0, 500), WEIGHTS)
def test_shares_are_as_near_to_the_weights_as_whole_scans_can_be(
    total: int, weights: list[float]
) -> None:
    shares = shared_out(total, weights)
    assert sum(shares) == total
    exact = total * np.array(weights) / sum(weights)
    assert (np.abs(np.array(shares) - exact) < 1 + 1e-9).all()


@given(SIZES, st.integers(1, 30), st.integers(0, 20), st.integers(1, 4), st.integers(0, 99))
def test_processes_draw_together_what_one_draws_alone(
    sizes: list[int], drawn: int, epoch: int, processes: int, seed: int
) -> None:
    draws = Draws(tuple(sizes), (drawn,) * len(sizes))
    (alone,) = order(draws, 1, epoch, seed)
    shares = order(draws, processes, epoch, seed)
    together = [pick for step in zip(*shares, strict=True) for pick in step]
    assert together == (alone * processes)[: len(together)]
    parts = np.repeat(np.arange(len(sizes)), sizes)
    assert Counter(int(parts[pick.number]) for pick in alone) == dict.fromkeys(
        range(len(sizes)), drawn
    )
    assert {(pick.epoch, pick.measured) for pick in alone} == {(epoch, False)}
    # What comes twice is told apart, to be augmented in another way.
    assert len({(pick.number, pick.again) for pick in alone}) == len(alone)


@given(st.integers(1, 12), st.integers(1, 30), st.integers(1, 12))
def test_no_scan_is_seen_twice_more_often_than_another(scans: int, drawn: int, epochs: int) -> None:
    draws = Draws((3, scans), (2, drawn))
    seen = Counter(
        pick.number for epoch in range(epochs) for pick in draws.picks(seed=1, epoch=epoch)
    )
    of_second = [seen[number] for number in range(3, 3 + scans)]
    assert sum(of_second) == epochs * drawn
    assert max(of_second) - min(of_second) <= 1


def test_draws_differ_by_seed_and_epoch_and_are_known_without_the_earlier_ones() -> None:
    draws = Draws.by_weight({"one": 50, "other": 7}, {"one": 1, "other": 1}, 20)
    epochs = [order(draws, 1, epoch, seed)[0] for seed in range(3) for epoch in range(5)]
    numbers = {tuple(pick.number for pick in picks) for picks in epochs}
    assert len(numbers) == len(epochs)
    again = sampler(draws, 2, 1, 0)
    again.set_epoch(4)
    assert list(again) == epochs[-1]


def test_a_part_without_a_scan_of_an_epoch_is_told() -> None:
    with pytest.raises(InputError, match="'dim': its weight gives it none of the 10 scans"):
        Draws.by_weight({"dim": 10, "bright": 10}, {"dim": 0.01, "bright": 1}, 10)
