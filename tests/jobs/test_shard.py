"""Shards of a job: complete, disjoint, balanced, and the same for every task."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from derain.errors import InputError
from derain.jobs.shard import Shard, array_expression, shard_numbers
from derain.jobs.unit import Unit

SIZES = st.lists(st.integers(0, 10**9), max_size=60)


def units_of(sizes: list[int]) -> list[Unit]:
    return [Unit(id=f"{place}", size=size, inputs="") for place, size in enumerate(sizes)]


@given(SIZES, st.integers(1, 9), st.randoms())
def test_shards_hold_each_unit_once_whatever_the_order(sizes, count, generator) -> None:
    units = units_of(sizes)
    number_of = shard_numbers(units, count)
    assert number_of.keys() == {unit.id for unit in units}
    generator.shuffle(units)
    assert shard_numbers(units, count) == number_of
    parts = [Shard(number, count).of(units) for number in range(count)]
    assert sorted(unit.id for part in parts for unit in part) == sorted(number_of)


@given(SIZES, st.integers(1, 9))
def test_no_shard_is_larger_than_another_by_more_than_its_last_unit(sizes, count) -> None:
    units = units_of(sizes)
    loads = [sum(unit.size for unit in Shard(n, count).of(units)) for n in range(count)]
    assert max(loads) - min(loads) <= max(sizes, default=0)


@given(st.sets(st.integers(0, 300)))
def test_an_array_expression_names_each_task_once(numbers) -> None:
    named: list[int] = []
    for part in filter(None, array_expression(list(numbers)).split(",")):
        first, _, last = part.partition("-")
        named += range(int(first), int(last or first) + 1)
    assert named == sorted(numbers)


def slurm_task(number: int, first: int, last: int) -> Shard | None:
    """The shard of a task of a SLURM array."""
    names = ("SLURM_ARRAY_TASK_ID", "SLURM_ARRAY_TASK_MIN", "SLURM_ARRAY_TASK_MAX")
    return Shard.of_environment(dict(zip(names, map(str, (number, first, last)), strict=True)))


def test_the_tasks_of_a_slurm_array_are_counted_from_its_first() -> None:
    task = slurm_task(7, 5, 8)
    assert task == Shard(2, 4, first=5, of_array=True)
    assert Shard.of_environment({}) is None
    assert task.within(None) == task


def test_tasks_that_are_run_again_do_the_shards_that_the_job_was_begun_in() -> None:
    task = slurm_task(17, 3, 20)
    assert task.within((100, 1)) == Shard(16, 100, first=1, of_array=True)
    with pytest.raises(InputError, match="no shard 17: the 10 shards are 0 to 9"):
        task.within((10, 0))
    assert Shard(1, 2).within((100, 1)) == Shard(1, 2)


def test_a_shard_that_is_not_there_is_refused() -> None:
    with pytest.raises(InputError, match=r"no shard 4.*0 to 3"):
        Shard.of_text("4/4")
    for text in ("4", "a/b", "-1/4", "1/0x4", "0/0"):
        with pytest.raises(InputError, match="I/N"):
            Shard.of_text(text)


@pytest.mark.parametrize("name", ["SLURM_ARRAY_TASK_ID", "SLURM_ARRAY_TASK_MAX"])
def test_a_variable_of_slurm_that_is_no_number_is_refused(name) -> None:
    with pytest.raises(InputError, match="SLURM_ARRAY_TASK_ID"):
        Shard.of_environment({"SLURM_ARRAY_TASK_ID": "1", name: ""})
