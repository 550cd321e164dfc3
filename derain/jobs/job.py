"""A job in a folder: its options, its units, and a record of each unit that is done.

They lie beside the results, in the hidden folder ``.derain``: ``job.json``, ``units.json``, and a
record ``units/<id>.json`` for each unit that is done or failed. Each file is written whole.
"""

import json
import os
import shutil
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import Any, Self, TypeVar

from derain.errors import InputError
from derain.files.atomic import replacing, temporary_folder, writing
from derain.jobs.record import Record
from derain.jobs.shard import Shard
from derain.jobs.unit import Unit

FOLDER = ".derain"
JOB, UNITS, RECORDS = "job.json", "units.json", "units"

UnitT = TypeVar("UnitT", bound=Unit)


@dataclass(frozen=True)
class Job:
    """What is done in a folder, and by which options.

    Attributes:
        folder: The folder of the results.
        options: Texts, numbers, true or false by name, among them the command and derain's version:
            all of what the results depend on but the inputs.
        shards: How many shards it was begun in, and what a batch system calls the first of them;
            None where it was begun as a whole.
    """

    folder: Path
    options: Mapping[str, Any]
    shards: tuple[int, int] | None = None

    @classmethod
    def begin(
        cls, folder: Path, options: Mapping[str, Any], shard: Shard | None, anew: bool = False
    ) -> Self:
        """Begins a job, or goes on with the one of the folder.

        Args:
            folder: The folder of the results, made if missing.
            options: The options.
            shard: The shard that is done now; None for all of it.
            anew: Whether the records of another job are removed; its results stay until they are
                written anew.

        Raises:
            InputError: The folder is of a job with other options, or cannot be written.
        """
        with writing(folder):
            if anew:
                shutil.rmtree(folder / FOLDER, ignore_errors=True)
            # As a reader will see it: tuples are lists there.
            ours = cls(
                folder,
                json.loads(json.dumps(options)),
                None if shard is None else (shard.count, shard.first),
            )
            begun = ours if ours._claim() else cls.at(folder)
        ours._refuse_other(begun)
        return begun

    @classmethod
    def at(cls, folder: Path) -> Self:
        """The job of a folder.

        Raises:
            InputError: There is none.
        """
        try:
            read = json.loads((folder / FOLDER / JOB).read_bytes())
            shards = read["shards"]
            return cls(folder, dict(read["options"]), None if shards is None else tuple(shards))
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise InputError(
                folder,
                "holds no records of a job",
                "Name the folder that --out named, of a run over several recordings.",
            ) from error

    @staticmethod
    def is_begun(folder: Path) -> bool:
        """Whether a folder has a job."""
        return (folder / FOLDER / JOB).exists()

    @cached_property
    def fingerprint(self) -> str:
        """Of its options, 16 hexadecimal digits."""
        return sha256(json.dumps(self.options, sort_keys=True).encode()).hexdigest()[:16]

    def list_units(self, units: Sequence[Unit]) -> None:
        """Writes which units there are, for :meth:`listed`.

        Raises:
            InputError: They cannot be written.
        """
        listed = [[unit.id, unit.size, unit.inputs] for unit in units]
        _write(self.folder / FOLDER / UNITS, listed)

    def shard_of(self, units: list[UnitT], shard: Shard | None) -> list[UnitT]:
        """The units of a shard, in their order.

        Args:
            units: All units.
            shard: The shard; None for all of them.
        """
        return units if shard is None else shard.within(self.shards).of(units)

    def listed(self) -> list[Unit]:
        """The units of the last command that went on with it."""
        listed = _read(self.folder / FOLDER / UNITS) or []
        return [Unit(id=id_, size=size, inputs=inputs) for id_, size, inputs in listed]

    def record(self, record: Record) -> None:
        """Writes the record of a unit, whose results are complete by now.

        Raises:
            InputError: It cannot be written.
        """
        _write(self._path(record.unit), asdict(record))

    def record_of(self, unit: Unit) -> Record | None:
        """The record of a unit; None where it was not done with these inputs and options."""
        read = _read(self._path(unit.id))
        try:
            record = Record(**read)
        except TypeError:  # none, or that of another version
            return None
        unchanged = (unit.inputs, self.fingerprint) == (record.inputs, record.options)
        return record if unchanged else None

    def _path(self, unit: str) -> Path:
        return self.folder / FOLDER / RECORDS / f"{unit}.json"

    def _claim(self) -> bool:
        """Writes its options, unless another job has written some."""
        path = self.folder / FOLDER / JOB
        if path.exists():
            return False
        with temporary_folder(path.parent) as temporary:
            written = temporary / JOB
            text = json.dumps({"options": self.options, "shards": self.shards}, indent=1)
            written.write_text(text, "utf-8")
            try:
                os.link(written, path)  # unlike os.replace, it fails where another was quicker
            except FileExistsError:
                return False
            except OSError:  # a file system without links
                os.replace(written, path)
        return True

    def _refuse_other(self, begun: "Job") -> None:
        """Refuses to go on with a job that was begun by other options."""
        if changed := differences(begun.options, self.options):
            raise InputError(
                self.folder,
                f"was begun by other options: {changed}",
                "Give --out another folder, or --anew to have all of it done again.",
            )


def differences(begun: Mapping[str, Any], now: Mapping[str, Any]) -> str:
    """Names the options that were others where something began; empty where none was.

    Args:
        begun: The options by which it began.
        now: Those of now.
    """
    names = [*begun, *(name for name in now if name not in begun)]
    return ", ".join(
        f"{name} was {begun.get(name, 'not there')} and is {now.get(name, 'not there')}"
        for name in names
        if begun.get(name) != now.get(name)
    )


def _write(path: Path, content: Any) -> None:
    with replacing(path) as temporary:
        temporary.write_text(json.dumps(content), "utf-8")


def _read(path: Path) -> Any:
    """The content of a file; None where it is not there, or damaged."""
    with suppress(OSError, ValueError):
        return json.loads(path.read_bytes())
    return None
