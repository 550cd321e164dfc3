"""Who reads which scan, and when: every one once, on any number of processes."""

from collections import Counter
from itertools import zip_longest

import lightning
import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch.utils.data import BatchSampler

from derain.datamodules.augmentation import Augmentation
from derain.datamodules.base import ScanDataModule
from derain.datamodules.order import Draws, MeasuringOrder, Pick, TrainingOrder, shared_out
from derain.errors import InputError
from derain.learning.batch import Batch

SIZES = st.integers(1, 30)
PROCESSES = st.integers(1, 5)
EVERYTHING = Augmentation(1, 1, mirror_probability=0.5, dropping_probability=1)


def orders(
    scans: int, processes: int, epoch: int = 0, seed: int = 0, draws: Draws | None = None
) -> list[list[Pick]]:
    """What each process reads in an epoch of training."""
    samplers = [
        TrainingOrder(range(scans), seed, processes, own, draws) for own in range(processes)
    ]
    for sampler in samplers:
        sampler.set_epoch(epoch)
        assert len(sampler) == len(list(sampler))
    return [list(sampler) for sampler in samplers]


@given(SIZES, PROCESSES, st.integers(0, 9), st.integers(0, 2**32 - 1))
def test_an_epoch_of_training_reads_every_scan_and_none_more_often_than_it_must(
    scans, processes, epoch, seed
) -> None:
    shares = orders(scans, processes, epoch, seed)
    (steps,) = {len(share) for share in shares}
    assert steps == -(-scans // processes)
    together = [pick for step in zip(*shares, strict=True) for pick in step]
    (alone,) = orders(scans, 1, epoch, seed)
    # In turn, so that a step of all processes is a batch of one.
    assert together == (alone * processes)[: len(together)]
    assert sorted(pick.number for pick in alone) == list(range(scans))
    assert {(pick.epoch, pick.measured) for pick in together} == {(epoch, False)}


def test_orders_differ_by_seed_and_epoch_and_put_no_scan_first() -> None:
    drawn = [orders(40, 1, epoch, seed)[0] for epoch in range(10) for seed in range(40)]
    numbers = {tuple(pick.number for pick in order) for order in drawn}
    assert len(numbers) == 400
    first = np.bincount([order[0] for order in numbers], minlength=40)
    assert first.max() < 30  # of 10 on average
    assert (first > 0).all()


@given(SIZES, PROCESSES, st.integers(1, 7))
def test_every_scan_is_measured_once_in_the_same_batches_on_any_number_of_processes(
    scans, processes, batch_size
) -> None:
    samplers = [
        MeasuringOrder(range(scans), batch_size, processes, own) for own in range(processes)
    ]
    assert all(len(sampler) == len(list(sampler)) for sampler in samplers)
    shares = [list(BatchSampler(sampler, batch_size, drop_last=False)) for sampler in samplers]
    assert len({len(share) for share in shares}) == 1  # nobody waits for nobody
    batches = [batch for step in zip_longest(*shares) for batch in step]
    for batch in batches:
        assert len({pick.measured for pick in batch}) == 1
    measured = [[pick.number for pick in batch] for batch in batches if batch[0].measured]
    numbers = list(range(scans))
    assert measured == [numbers[i : i + batch_size] for i in range(0, scans, batch_size)]


def trained_on(data: ScanDataModule, epochs: range) -> list[list[Batch]]:
    """Batches of some epochs, as Lightning has them read."""
    loader = data.train_dataloader()
    received = []
    for epoch in epochs:
        loader.sampler.set_epoch(epoch)
        received.append(list(loader))
    return received


def same(one: Batch, other: Batch) -> bool:
    pairs = [*zip(one.inputs.values(), other.inputs.values(), strict=True)]
    return all(a.shape == b.shape and torch.equal(a, b) for a, b in pairs)


@pytest.mark.parametrize("workers", [0, 2])
def test_scans_are_changed_by_seed_epoch_and_scan_whoever_reads_them_and_wherever_a_run_starts(
    folder, connect, workers
) -> None:
    lightning.seed_everything(3)
    here = connect(folder(augmentation=EVERYTHING, batch_size=2))
    expected = trained_on(here, range(4))
    torch.manual_seed(workers)  # nobody else's draws matter
    there = connect(folder(augmentation=EVERYTHING, batch_size=2, workers=workers))
    for before, after in zip(expected[2:], trained_on(there, range(2, 4)), strict=True):
        assert all(same(a, b) for a, b in zip(before, after, strict=True))
    drawn = [batch for epoch in expected for batch in epoch]
    assert not any(same(a, b) for a in drawn for b in drawn if a is not b)
    lightning.seed_everything(4)
    (other,) = trained_on(connect(folder(augmentation=EVERYTHING, batch_size=2)), range(1))
    assert not any(same(a, b) for a, b in zip(expected[0], other, strict=True))


# What an epoch draws from several data sets: by weight, and of each all scans equally often.
WEIGHTS = st.lists(st.floats(0.1, 10), min_size=1, max_size=5)
DATA_SETS = st.lists(st.integers(1, 12), min_size=1, max_size=4)


@given(st.integers(0, 500), WEIGHTS)
def test_shares_are_as_near_to_the_weights_as_whole_scans_can_be(total, weights) -> None:
    shares = shared_out(total, weights)
    assert sum(shares) == total
    exact = total * np.array(weights) / sum(weights)
    assert (np.abs(np.array(shares) - exact) < 1 + 1e-9).all()


@given(DATA_SETS, st.integers(1, 30), st.integers(0, 20), st.integers(1, 4), st.integers(0, 99))
def test_processes_draw_together_what_one_draws_alone(sizes, drawn, epoch, processes, seed) -> None:
    draws = Draws(tuple(sizes), (drawn,) * len(sizes))
    scans = sum(sizes)
    (alone,) = orders(scans, 1, epoch, seed, draws)
    shares = orders(scans, processes, epoch, seed, draws)
    together = [pick for step in zip(*shares, strict=True) for pick in step]
    assert together == (alone * processes)[: len(together)]
    parts = np.repeat(np.arange(len(sizes)), sizes)
    assert Counter(int(parts[pick.number]) for pick in alone) == dict.fromkeys(
        range(len(sizes)), drawn
    )
    assert {(pick.epoch, pick.measured) for pick in alone} == {(epoch, False)}
    # What comes twice has two numbers, to be augmented in another way.
    assert len({(pick.number, pick.again) for pick in alone}) == len(alone)


@given(st.integers(1, 12), st.integers(1, 30), st.integers(1, 12))
def test_no_scan_is_seen_twice_more_often_than_another(scans, drawn, epochs) -> None:
    draws = Draws((3, scans), (2, drawn))
    seen = Counter(
        pick.number for epoch in range(epochs) for pick in draws.picks(seed=1, epoch=epoch)
    )
    of_second = [seen[number] for number in range(3, 3 + scans)]
    assert sum(of_second) == epochs * drawn
    assert max(of_second) - min(of_second) <= 1


def test_draws_differ_by_seed_and_epoch_and_are_known_without_the_earlier_ones() -> None:
    draws = Draws.by_weight({"one": 50, "other": 7}, {"one": 1, "other": 1}, 20)
    epochs = [orders(57, 1, epoch, seed, draws)[0] for seed in range(3) for epoch in range(5)]
    numbers = {tuple(pick.number for pick in picks) for picks in epochs}
    assert len(numbers) == len(epochs)
    assert orders(57, 1, 4, 2, draws) == [epochs[-1]]


@pytest.mark.parametrize("total", [10, 0, -1])
def test_a_part_without_a_scan_of_an_epoch_is_refused(total) -> None:
    with pytest.raises(InputError, match=f"its weight gives it none of the {total} scans"):
        Draws.by_weight({"dim": 10, "bright": 10}, {"dim": 0.01, "bright": 1}, total)
