"""A fuzzed reader: its inputs, and the check of its results."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from random import Random

from benchmarks.fuzzing.mutations import damaged

Make = Callable[[Random], bytes]


@dataclass(frozen=True)
class Reader:
    """A reader of one kind of file.

    Attributes:
        name: What it is called.
        file: Name that its files have.
        read: Reads a file as derain does. It returns where the result is right, and raises
            InputError where the file is refused; anything else is a finding.
        seeds: Makes files that are right, and must be read.
        hostile: Files that somebody thought out; they come after those.
        change: Makes a damaged file in a way of its own, knowing what is in it; half of the inputs.
    """

    name: str
    file: str
    read: Callable[[Path], object]
    seeds: Callable[[], Sequence[bytes]]
    hostile: Sequence[Callable[[], bytes]] = ()
    change: Make | None = None

    @cached_property
    def _seeds(self) -> Sequence[bytes]:
        return self.seeds()

    def must_read(self, number: int) -> bool:
        """True if an input is undamaged."""
        return number < len(self._seeds)

    def content(self, seed: int, number: int) -> bytes:
        """An input: those that are right, then the hostile ones, then damaged ones without end.

        Args:
            seed: Of the whole run.
            number: Which one; it does not depend on those before it.
        """
        if self.must_read(number):
            return self._seeds[number]
        if number < len(self._seeds) + len(self.hostile):
            return self.hostile[number - len(self._seeds)]()
        generator = Random(f"{seed} {self.name} {number}")
        if self.change is not None and generator.random() < 0.5:
            return self.change(generator)
        return damaged(generator.choice(self._seeds), generator.choice(self._seeds), generator)
