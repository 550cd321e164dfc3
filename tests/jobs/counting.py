"""Work that tests can follow: each unit writes a file, and some fail, or kill their process."""

import os
from dataclasses import dataclass
from pathlib import Path

from derain.errors import InputError
from derain.jobs.running import IsThere, Value, ValueWork
from derain.jobs.unit import Unit


@dataclass(frozen=True)
class Counting(ValueWork[Unit]):
    """Writes ``<id>.txt`` for each unit, and a line to ``<id>.tries`` for each time it is done.

    Attributes:
        folder: Where to.
        failing: Ids of units that cannot be done.
        killing: Ids of units that kill their process.
        killing_once: Ids of those that kill it the first time.
        unfit: Whether no process can do the work.
    """

    folder: Path
    failing: tuple[str, ...] = ()
    killing: tuple[str, ...] = ()
    killing_once: tuple[str, ...] = ()
    unfit: bool = False

    def check(self) -> None:
        if self.unfit:
            raise InputError("model.onnx", "there is no such file", "Copy it.")

    def value(self, unit: Unit) -> str:
        tries = self.folder / f"{unit.id}.tries"
        first = not tries.exists()
        with tries.open("a") as lines:
            lines.write("tried\n")
        if unit.id in self.killing or (first and unit.id in self.killing_once):
            os._exit(9)
        if unit.id in self.failing:
            raise InputError(unit.id, "is broken", "Mend it.")
        (self.folder / f"{unit.id}.txt").write_text(unit.id)
        return f"{unit.id} done"

    def look(self) -> IsThere[Unit, Value]:
        return lambda unit, values: (self.folder / f"{unit.id}.txt").exists()
