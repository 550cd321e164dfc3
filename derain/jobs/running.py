"""Does the units of a job, here or by an executor, and passes over those that are done."""

import os
import pickle
import platform
import threading
import time
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, CancelledError
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar, cast

from tqdm import tqdm

import derain
from derain.errors import InputError, reason_of
from derain.jobs.job import Job
from derain.jobs.unit import Record, Unit
from derain.system.notices import warn

# Largest number of finished units that wait, with their results, for an earlier one to be reported.
AHEAD = 1000


class UnfitWorkerError(InputError):
    """A process of an executor cannot do a job as it was begun."""


class Submits(Protocol):
    """An executor: any of :mod:`concurrent.futures`, of Dask, of submitit, or the like.

    What ``submit`` returns needs ``result()`` and ``done()``.
    """

    def submit(self, work: Callable[..., Any], /, *args: Any) -> Any:
        """Has work done, now or later, here or elsewhere."""


class Result(Protocol):
    """The result of a unit, or of a part of it."""

    @property
    def error(self) -> InputError | None:
        """Why nothing came of it; None where something did."""

    def to_json(self) -> Any:
        """The result as its record has it."""


UnitT = TypeVar("UnitT", bound=Unit)
ResultT = TypeVar("ResultT", bound=Result)

# Returns True if all files that a unit wrote exist, by its results.
IsThere = Callable[[UnitT, list[ResultT]], bool]


class Work(ABC, Generic[UnitT, ResultT]):
    """The work for each unit. It is pickled once per job, and each thread keeps its last one."""

    @abstractmethod
    def do(self, unit: UnitT) -> Iterator[ResultT]:
        """Does a unit and yields its results; its files are complete at the end.

        Raises:
            InputError: The whole unit fails.
        """

    @abstractmethod
    def failed(self, unit: UnitT, error: InputError) -> ResultT:
        """The result of a unit that failed as a whole."""

    @abstractmethod
    def from_json(self, unit: UnitT, written: Any) -> ResultT:
        """A result from its record.

        Raises:
            LookupError, TypeError, ValueError: The record is of another version.
        """

    def look(self) -> IsThere[UnitT, ResultT]:
        """Checks the written results; work that writes nothing is always complete."""
        return lambda unit, results: True

    def check(self) -> None:
        """Refuses a process if its results would differ from those of the job's first process.

        Raises:
            InputError: For instance because the process sees another content of a file.
        """


@dataclass(frozen=True)
class Value:
    """The only result of a unit.

    Attributes:
        content: The result, of primitives of JSON.
        error: Reason for a missing result.
    """

    content: Any = None
    error: InputError | None = None

    def to_json(self) -> Any:
        """The result, unchanged."""
        return self.content


class ValueWork(Work[UnitT, Value]):
    """Work with one result a unit."""

    @abstractmethod
    def value(self, unit: UnitT) -> Any:
        """Does a unit, and returns its result, of primitives of JSON.

        Raises:
            InputError: It cannot be done.
        """

    def do(self, unit: UnitT) -> Iterator[Value]:
        """Does a unit."""
        yield Value(self.value(unit))

    def failed(self, unit: UnitT, error: InputError) -> Value:
        """The result of a unit that failed."""
        return Value(error=error)

    def from_json(self, unit: UnitT, written: Any) -> Value:
        """A result from its record."""
        return Value(written)


@dataclass(frozen=True)
class Task(Generic[UnitT, ResultT]):
    """The part of a job that one process does, with a record of each unit.

    Attributes:
        job: The job; None keeps no records.
        work: The work for each unit.
        folder: The folder that relative paths start from; None if there are none.
        version: The version of derain that began it.
    """

    job: Job | None
    work: Work[UnitT, ResultT]
    folder: Path | None = None
    version: str = derain.__version__

    def check(self) -> None:
        """Refuses another folder, another version of derain, and what the work refuses."""
        if self.folder is not None and self.folder != Path.cwd():
            raise InputError(
                "paths",
                f"it runs in {Path.cwd()}, and they begin in {self.folder}",
                "Give absolute paths.",
            )
        if self.version != derain.__version__:
            raise InputError(
                "worker",
                f"it has derain {derain.__version__}, and this command {self.version}",
                "Install the same version everywhere.",
            )
        self.work.check()

    def done(self, units: Sequence[UnitT]) -> Iterator[tuple[UnitT, list[ResultT] | None]]:
        """The results of each unit by its record; None for a unit to be done."""
        if self.job is None:
            yield from ((unit, None) for unit in units)
            return
        is_there = self.work.look()
        for unit, record in self.job.records_of(units):
            results = None
            if record is not None and not record.errors:
                with suppress(LookupError, TypeError, ValueError):  # of another version: done again
                    results = [self.work.from_json(unit, written) for written in record.results]
            yield unit, results if results is not None and is_there(unit, results) else None

    def do(self, unit: UnitT) -> Iterator[ResultT]:
        """Does a unit and yields its results, and writes its record at the end."""
        seconds, results = 0.0, []
        pending = self.work.do(unit)
        try:
            while True:
                began = time.perf_counter()
                result = next(pending, None)
                seconds += time.perf_counter() - began  # without the caller's own work
                if result is None:
                    break
                results.append(result)
                yield result
        except InputError as error:
            results.append(self.work.failed(unit, error))
            yield results[-1]
        self._record(unit, results, seconds)

    def fail(self, unit: UnitT, error: InputError) -> list[ResultT]:
        """The results of a unit that failed where its process could not record it."""
        results = [self.work.failed(unit, error)]
        self._record(unit, results, 0.0)
        return results

    def _record(self, unit: UnitT, results: list[ResultT], seconds: float) -> None:
        if self.job is None:
            return
        errors = [each.error for each in results if each.error is not None]
        record = Record(
            unit=unit.id,
            inputs=unit.inputs,
            options=self.job.fingerprint,
            worker=f"{platform.node()}-{os.getpid()}",
            seconds=round(seconds, 3),
            errors=[[str(error.subject), error.reason, error.remedy] for error in errors],
            results=[each.to_json() for each in results if each.error is None],
        )
        self.job.record(record)


# A unit, one of its results, and whether an earlier command had that.
UnitResult = tuple[UnitT, ResultT, bool]


def run(
    task: Task[UnitT, ResultT],
    units: Sequence[UnitT],
    executor: Submits | None = None,
) -> Iterator[UnitResult[UnitT, ResultT]]:
    """Does the units of a job that are not done.

    Args:
        task: Work for each unit.
        units: The units.
        executor: Executor of the units; None does one after the other in this process.

    Yields:
        A unit, one of its results, and True if an earlier command had that; in the order of the
        units, as soon as it and all before it are known.

    Raises:
        InputError: The executor has ended, or its processes cannot do the work.
    """
    if executor is None:
        for unit, done in task.done(units):
            for result in task.do(unit) if done is None else done:
                yield unit, result, done is not None
    else:
        yield from _run_on_executor(executor, task, units)


def completed(task: Task[UnitT, ResultT], units: Sequence[UnitT]) -> list[ResultT] | None:
    """The results of all units of a job, from all processes; None while one is missing.

    Args:
        task: Work for each unit.
        units: All units of the job.
    """
    results: list[ResultT] = []
    for _, done in task.done(units):
        if done is None:
            return None
        results += done
    return results


def values(
    task: Task[UnitT, Value],
    units: Sequence[UnitT],
    shard: Sequence[UnitT],
    executor: Submits | None,
    doing: str,
    unit: str = "unit",
) -> list[Any] | None:
    """Does the units of a shard, and returns the results of all units.

    Where records are kept, a unit that fails does not stop the others.

    Args:
        task: Work for each unit.
        units: All units of the job.
        shard: Those that are done now.
        executor: Executor of the units; None does one after the other in this process.
        doing: Its title in a progress bar, such as "counting".
        unit: Name of a unit in messages.

    Returns:
        The results, in the order of the units; None while other shards are to be done.

    Raises:
        InputError: A unit failed; or as for :func:`run`.
    """
    found: list[Any] = []
    failures: dict[str, InputError] = {}  # by unit
    results = run(task, shard, executor)
    for done, value, _ in tqdm(results, total=len(shard), desc=doing, unit=unit, disable=None):
        if (error := value.error) is None:
            found.append(value.content)
        elif task.job is None:
            raise error
        else:
            if failures:  # the first one is in the error below
                warn(f"{done.id}: {error}")
            failures[done.id] = error
    if failures:
        failed, first = next(iter(failures.items()))
        raise InputError(
            first.subject,
            f"{first.reason}, so that {len(failures):,} of {len(shard):,} {unit}s failed, first "
            f"{failed}",
            f"{first.remedy} The same command retries them.",
        )
    if len(shard) == len(units):
        return found
    results_of_units = completed(task, units)
    return None if results_of_units is None else [each.content for each in results_of_units]


def _run_on_executor(
    executor: Submits, task: Task[UnitT, ResultT], units: Sequence[UnitT]
) -> Iterator[UnitResult[UnitT, ResultT]]:
    pickled = pickle.dumps(task)
    waiting: deque[tuple[UnitT, list[ResultT] | None, Any]] = deque()
    for unit, done in task.done(units):
        future = None
        if done is None:
            try:
                future = executor.submit(do_unit, pickled, unit)
            except RuntimeError as error:  # it is shut down, or broken
                raise _ended(unit, error) from error
        waiting.append((unit, done, future))
        while waiting and (len(waiting) > AHEAD or waiting[0][2] is None or waiting[0][2].done()):
            yield from _next_results(task, waiting)
    while waiting:
        yield from _next_results(task, waiting)


def _next_results(
    task: Task[UnitT, ResultT], waiting: deque[tuple[UnitT, list[ResultT] | None, Any]]
) -> Iterator[UnitResult[UnitT, ResultT]]:
    unit, done, future = waiting.popleft()
    for result in _await_results(task, unit, future) if done is None else done:
        yield unit, result, done is not None


def _await_results(task: Task[UnitT, ResultT], unit: UnitT, future: Any) -> Sequence[ResultT]:
    """Waits for the results of a submitted unit.

    Raises:
        InputError: As for :func:`run`.
    """
    try:
        results: list[ResultT] = future.result()
        return results
    except (BrokenExecutor, CancelledError) as error:
        raise _ended(unit, error) from error
    except UnfitWorkerError:
        raise
    except InputError as error:
        return task.fail(unit, error)
    except Exception as error:  # the executor's own processes may raise anything
        reason = f"its worker failed ({type(error).__name__}: {error})"
        return task.fail(unit, InputError(unit.id, reason, "See the log of the worker."))


def _ended(unit: Unit, error: Exception) -> InputError:
    """The error of an executor that does no further unit."""
    return InputError(
        "executor",
        f"it ended before {unit.id} was done ({reason_of(error)})",
        "Run the same command again: it does the remaining units.",
    )


def do_unit(pickled: bytes, unit: UnitT) -> list[Any]:
    """Does a unit in a process of an executor.

    Args:
        pickled: The :class:`Task`.
        unit: The unit.
    """
    return list(_task(pickled).do(unit))


# The last task of each thread. Methods have state, so no two threads share one.
_last = threading.local()


def _task(pickled: bytes) -> Task[Any, Any]:
    """The task that a thread keeps while it does one unit after the other.

    Raises:
        UnfitWorkerError: It cannot be done there.
    """
    if getattr(_last, "pickled", None) == pickled:
        return cast(Task[Any, Any], _last.task)
    try:
        task: Task[Any, Any] = pickle.loads(pickled)
        task.check()
    except InputError as error:
        where = f"worker {platform.node()}: {error.subject}"
        raise UnfitWorkerError(where, error.reason, error.remedy) from error
    except Exception as error:  # for instance a module that is not installed there
        raise UnfitWorkerError(
            f"worker {platform.node()}",
            f"it cannot load the work ({type(error).__name__}: {error})",
            "Install the same packages everywhere.",
        ) from error
    _last.pickled, _last.task = pickled, task
    return task
