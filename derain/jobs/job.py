"""A job in a folder: its options, its units, a record of each unit that is done, and its progress.

They lie beside the results, in the hidden folder ``.derain``: ``job.json``, ``units.json``, and a
record ``units/<id>.json`` for each unit that is done or failed. Each file is written whole.
"""

import json
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from hashlib import sha256
from typing import Any, Self, TypeVar

from derain.errors import InputError
from derain.jobs.shard import Shard, array_expression, shard_numbers
from derain.jobs.unit import Record, Unit
from derain.stores.documents import Documents, documents_at
from derain.stores.url import Place, without_secrets

# Options of an earlier version may differ by the dozen.
MOST_DIFFERENCES = 3

FOLDER = ".derain"
JOB, UNITS, RECORDS = "job.json", "units.json", "units"

UnitT = TypeVar("UnitT", bound=Unit)


@dataclass(frozen=True)
class Job:
    """The work done in a folder, and its options.

    Attributes:
        folder: The folder of the results, a path or a URL.
        options: Texts, numbers, true or false by name, among them the command and derain's version:
            all of what the results depend on but the inputs.
        shards: Number of shards that it was started in, and a batch system's number of the first;
            None if it was begun as a whole.
    """

    folder: Place
    options: Mapping[str, Any]
    shards: tuple[int, int] | None = None

    @classmethod
    def begin(
        cls,
        folder: Place,
        options: Mapping[str, Any],
        units: list[UnitT],
        shard: Shard | None = None,
        anew: bool = False,
    ) -> tuple[Self, list[UnitT]]:
        """Starts a job, or resumes the one of the folder.

        Args:
            folder: The folder of the results, made if missing.
            options: The options.
            units: All of its units, which are listed for :meth:`listed`.
            shard: The shard that is done now; None for all of it.
            anew: True to remove the records of another job; its results stay until they are
                overwritten.

        Returns:
            The job, and the units that are done now, in their order.

        Raises:
            InputError: The folder is of a job with other options, or cannot be written.
        """
        documents = documents_at(folder, FOLDER)
        if anew:
            documents.remove_all()
        shards = None if shard is None else (shard.count, shard.first)
        written = json.dumps({"options": options, "shards": shards}, indent=1)
        documents.create(JOB, written)
        begun = cls.at(folder)  # another command may have been quicker
        # JSON turns tuples into lists: compare options as they are read back.
        if changed := differences(begun.options, json.loads(written)["options"]):
            raise InputError(
                without_secrets(str(folder)),
                f"was started with other options: {changed}",
                "Give --out another folder, or do all of it again, by --anew where there is one.",
            )
        listed = [[unit.id, unit.size, unit.inputs] for unit in units]
        documents.write(UNITS, json.dumps(listed))
        return begun, units if shard is None else shard.within(begun.shards).of(units)

    @classmethod
    def at(cls, folder: Place) -> Self:
        """The job of a folder.

        Raises:
            InputError: There is none, or its options are damaged.
        """
        content = documents_at(folder, FOLDER).read(JOB)
        named = without_secrets(str(folder))
        if content is None:
            raise InputError(
                named,
                "holds no records of a job",
                "Name the --out folder of a run over many scans, or of one with --resume.",
            )
        try:
            read = json.loads(content)
            shards = read["shards"]
            if shards is not None:
                shards = int(shards[0]), int(shards[1])
            return cls(folder, dict(read["options"]), shards)
        except (ValueError, LookupError, TypeError) as error:
            reason = f"the options that it was begun by, {FOLDER}/{JOB}, are damaged"
            raise InputError(named, reason, "Do everything again with --anew.") from error

    @staticmethod
    def is_begun(folder: Place) -> bool:
        """True if a folder has a job."""
        return documents_at(folder, FOLDER).read(JOB) is not None

    @cached_property
    def fingerprint(self) -> str:
        """Fingerprint of its options, 16 hexadecimal digits."""
        return sha256(json.dumps(self.options, sort_keys=True).encode()).hexdigest()[:16]

    def listed(self) -> list[Unit]:
        """The units of the last command that went on with it.

        Raises:
            InputError: It was stopped before it listed them, or the list is damaged.
        """
        content = self._documents.read(UNITS)
        try:
            listed = json.loads(content or b"")
            return [Unit(id=id_, size=int(size), inputs=inputs) for id_, size, inputs in listed]
        except (TypeError, ValueError) as error:
            raise InputError(
                without_secrets(str(self.folder)),
                "was started, but its units are not listed yet",
                "Run the command that started it again.",
            ) from error

    def record(self, record: Record) -> None:
        """Writes the record of a unit, after its results are complete.

        Raises:
            InputError: It cannot be written.
        """
        content = asdict(record)
        content["checksum"] = _checksum(content)
        self._documents.write(_name(record.unit), json.dumps(content))

    def records_of(self, units: Sequence[UnitT]) -> Iterator[tuple[UnitT, Record | None]]:
        """The record of each unit; None if it was not done with these inputs and options.

        Args:
            units: The units.

        Raises:
            InputError: The store cannot be reached.
        """
        contents = self._documents.read_each([_name(unit.id) for unit in units])
        for unit, content in zip(units, contents, strict=True):
            yield unit, self._record_of(unit, content)

    def _record_of(self, unit: Unit, content: bytes | None) -> Record | None:
        try:
            written = json.loads(content or b"")
            checksum = written.pop("checksum", None)
            record = Record(**written)
        except (AttributeError, TypeError, ValueError):  # none, damaged, or of another version
            return None
        unchanged = (unit.inputs, self.fingerprint) == (record.inputs, record.options)
        return record if unchanged and checksum == _checksum(written) else None

    @property
    def _documents(self) -> Documents:
        return documents_at(self.folder, FOLDER)


@dataclass(frozen=True)
class JobStatus:
    """The progress of a job.

    Attributes:
        job: The job.
        units: All of its units, in order.
        done: Number of units that are done.
        failed: Records of the units that failed.
        missing: The units without a record.
        seconds: Time that the units that are done took, by worker.
    """

    job: Job
    units: list[Unit]
    done: int
    failed: list[Record]
    missing: list[Unit]
    seconds: dict[str, float]

    @property
    def array(self) -> str | None:
        """The tasks of ``sbatch --array`` with units to do; None without any, or without shards."""
        to_do = [*(record.unit for record in self.failed), *(unit.id for unit in self.missing)]
        if self.job.shards is None or not to_do:
            return None
        count, first = self.job.shards
        number_of = shard_numbers(self.units, count)
        return array_expression([number_of[unit] + first for unit in to_do])


def job_status(folder: Place, on_done: Callable[[Record], None]) -> JobStatus:
    """Reads the records of a job.

    Args:
        folder: The folder of its results, a path or a URL.
        on_done: Receives the record of each unit that is done, in the order of the units.

    Raises:
        InputError: There is no job in the folder.
    """
    job = Job.at(folder)
    units = job.listed()
    failed, missing = [], []
    seconds: dict[str, float] = defaultdict(float)
    for unit, record in job.records_of(units):
        if record is None:
            missing.append(unit)
            continue
        if record.errors:
            failed.append(record)
            continue
        seconds[record.worker] += record.seconds
        on_done(record)
    done = len(units) - len(failed) - len(missing)
    return JobStatus(job, units, done, failed, missing, seconds)


def differences(begun: Mapping[str, Any], now: Mapping[str, Any]) -> str:
    """Describes the first options that differ from those at the start; empty if none does.

    Args:
        begun: The options at the start.
        now: The options of this command.
    """
    names = [*begun, *(name for name in now if name not in begun)]
    changes = [
        f"{name} was {begun.get(name, 'not there')} and is {now.get(name, 'not there')}"
        for name in names
        if begun.get(name) != now.get(name)
    ]
    if further := changes[MOST_DIFFERENCES:]:
        changes = [*changes[:MOST_DIFFERENCES], f"and {len(further)} more"]
    return ", ".join(changes)


def _checksum(content: Any) -> str:
    """16 hexadecimal digits of the SHA-256 of what JSON holds."""
    return sha256(json.dumps(content).encode()).hexdigest()[:16]


def _name(unit: str) -> str:
    return f"{RECORDS}/{unit}.json"
