"""Shards of a job: parts of about the same size, each done by a command of its own."""

import heapq
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Self, TypeVar

from derain.errors import InputError
from derain.jobs.unit import Unit

# What SLURM gives each task of an array: its number, the first number, and the last.
# Source: sbatch(1), "Output environment variables".
TASK = "SLURM_ARRAY_TASK_ID"
FIRST_TASK, LAST_TASK = "SLURM_ARRAY_TASK_MIN", "SLURM_ARRAY_TASK_MAX"

UnitT = TypeVar("UnitT", bound=Unit)


@dataclass(frozen=True)
class Shard:
    """One of the shards of a job.

    Attributes:
        number: Number of the shard, from 0.
        count: Their number.
        first: A batch system's number of the first shard.
        of_array: True if it is a task of a batch system's array.

    Raises:
        InputError: No such shard.
    """

    number: int
    count: int
    first: int = 0
    of_array: bool = False

    def __post_init__(self) -> None:
        if not 0 <= self.number < self.count:
            last = self.first + self.count - 1
            raise InputError(
                TASK if self.of_array else "--shard",
                f"there is no shard {self.number + self.first}: the {self.count} shards are "
                f"{self.first} to {last}",
                f"Submit --array={self.first}-{last}." if self.of_array else "Give one of them.",
            )

    @classmethod
    def of_text(cls, text: str) -> Self:
        """Parses ``I/N``; the first shard is 0/N.

        Raises:
            InputError: Other text, or no such shard.
        """
        match = re.fullmatch(r"([0-9]{1,9})/([1-9][0-9]{0,8})", text, re.ASCII)
        if match is None:
            raise InputError("--shard", f"{text} is not I/N", "Give for instance 0/4.")
        return cls(int(match[1]), int(match[2]))

    @classmethod
    def of_environment(cls, environment: Mapping[str, str] = os.environ) -> Self | None:
        """The shard of this task of a SLURM array; None outside of an array.

        Raises:
            InputError: Numbers that SLURM does not give.
        """
        if TASK not in environment:
            return None
        try:
            task = int(environment[TASK])
            first = int(environment.get(FIRST_TASK, "0"))
            last = int(environment.get(LAST_TASK, task))
        except ValueError as error:
            reason = f"it or another variable of SLURM's is no number ({error})"
            raise InputError(TASK, reason, f"Unset {TASK} outside of an array.") from error
        return cls(task - first, last - first + 1, first, of_array=True)

    def within(self, begun: tuple[int, int] | None) -> Self:
        """The same task among the shards that a job was begun in.

        A batch system that runs some tasks of an array again counts these alone.

        Args:
            begun: Number of shards, and the number of the first; None for none.
        """
        if begun is None or not self.of_array:
            return self
        count, first = begun
        return replace(self, number=self.number + self.first - first, count=count, first=first)

    def of(self, units: Sequence[UnitT]) -> list[UnitT]:
        """The units of this shard, in their order: see :func:`shard_numbers`."""
        number_of = shard_numbers(units, self.count)
        return [unit for unit in units if number_of[unit.id] == self.number]


def shard_numbers(units: Sequence[Unit], count: int) -> dict[str, int]:
    """The shard of each unit, so that all shards are about as large.

    The largest unit comes first, and each goes to the smallest shard so far. Only ids and
    sizes matter, and not the order of the units.

    Args:
        units: The units.
        count: Number of shards.

    Returns:
        Number of the shard, from 0, by the id of each unit.

    Source: longest processing time first, R. L. Graham, "Bounds on Multiprocessing Timing
        Anomalies", 1969.
    """
    smallest = [(0, number) for number in range(count)]
    found = {}
    for unit in sorted(units, key=lambda unit: (-unit.size, unit.id)):
        size, number = heapq.heappop(smallest)
        found[unit.id] = number
        heapq.heappush(smallest, (size + unit.size, number))
    return found


def array_expression(numbers: Sequence[int]) -> str:
    """Numbers of tasks as ``sbatch --array`` takes them, such as ``0-3,7``.

    Args:
        numbers: The numbers, in any order.
    """
    ranges: list[list[int]] = []
    for number in sorted(set(numbers)):
        if ranges and number == ranges[-1][-1] + 1:
            ranges[-1][1:] = [number]
        else:
            ranges.append([number])
    return ",".join("-".join(map(str, each)) for each in ranges)
