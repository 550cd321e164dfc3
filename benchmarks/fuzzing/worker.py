"""A process that reads one input after another, and the one that watches over it."""

import multiprocessing
import os
import sys
import time
import traceback
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from multiprocessing.connection import Connection
from pathlib import Path

from benchmarks.fuzzing.reader import Reader
from derain.errors import LONGEST_REASON, InputError

# What an input may take: memory of the whole process in MB, and seconds of computing.
MOST_MEMORY = 1000
MOST_SECONDS = 10

# A process that is beyond these is ended; the machine may be busy with other things.
KILL_MEMORY = 2000
KILL_SECONDS = 120

RIGHT, REFUSED = "right", "refused"


Readers = Callable[[], Mapping[str, Reader]]


@dataclass(frozen=True)
class Outcome:
    """The outcome of reading one input.

    Attributes:
        number: Of the input.
        verdict: ``right``, ``refused``, or what is wrong.
        peak: Most memory of the process while it read, MB.
    """

    number: int
    verdict: str
    peak: int

    @property
    def is_finding(self) -> bool:
        """True if something is wrong."""
        return self.verdict not in (RIGHT, REFUSED)


def judge(reader: Reader, seed: int, number: int, folder: Path) -> Outcome:
    """Reads one input in this process.

    Args:
        reader: What reads it.
        seed: Of the whole run.
        number: Of the input.
        folder: Takes a folder for each reader: what one leaves must not be seen by another.
    """
    path = folder / reader.name / reader.file
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(reader.content(seed, number))
    _forget_peak()
    start = time.process_time()
    verdict = _verdict(reader, path, reader.must_read(number))
    seconds, peak = time.process_time() - start, _peak()
    if verdict in (RIGHT, REFUSED) and peak > MOST_MEMORY:
        verdict = f"{peak:,} MB of memory"
    elif verdict in (RIGHT, REFUSED) and seconds > MOST_SECONDS:
        verdict = f"{seconds:.0f} seconds of computing"
    return Outcome(number, verdict, peak)


def _verdict(reader: Reader, path: Path, must_read: bool) -> str:
    try:
        reader.read(path)
    except InputError as error:
        if must_read:
            return f"refused, though nothing is wrong with it: {error}"
        if not str(error).isprintable() or len(str(error)) > 3 * LONGEST_REASON:
            return f"a message of {len(str(error)):,} characters: {str(error)[:80]!r}"
        return REFUSED
    except (Exception, SystemExit) as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        place = f"{Path(where.filename).name}:{where.lineno}"
        return f"{type(error).__name__} at {place}: {str(error)[:200]}"
    return RIGHT


class Worker:
    """A process that judges inputs, and is started again if one has ended it.

    Args:
        seed: Of the whole run.
        folder: Takes the files.
        readers: Gives the readers by their names; it is called in the process, and pickled.
    """

    def __init__(self, seed: int, folder: Path, readers: Readers) -> None:
        self.folder = folder
        self._arguments = seed, folder, readers
        self._process: multiprocessing.process.BaseProcess | None = None
        self._connection: Connection | None = None

    def judge(self, reader: str, numbers: range) -> Iterator[Outcome]:
        """Judges inputs one by one; while an outcome is looked at, its file is still there."""
        for number in numbers:
            if self._connection is None:
                self._start()
            self._connection.send((reader, number))
            outcome = self._outcome(number)
            yield outcome
            if outcome.peak > MOST_MEMORY:  # it may not have given all of it back
                self.end()

    def end(self) -> None:
        """Ends the process."""
        if self._process is not None:
            self._process.kill()
            self._process.join()
        self._process = self._connection = None

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._connection, other = context.Pipe()
        self._process = context.Process(target=_serve, args=(other, *self._arguments), daemon=True)
        self._process.start()
        other.close()

    def _outcome(self, number: int) -> Outcome:
        start = time.monotonic()
        while not self._connection.poll(0.02):
            memory, seconds = _resident(self._process.pid), time.monotonic() - start
            if memory > KILL_MEMORY or seconds > KILL_SECONDS:
                self.end()
                return Outcome(number, f"ended with {memory:,} MB after {seconds:.0f} s", memory)
        with suppress(EOFError, ConnectionResetError):
            return self._connection.recv()
        self._process.join()
        code = self._process.exitcode
        printed = (self.folder / "stderr").read_text("utf-8", "replace").strip().splitlines()
        self.end()
        return Outcome(number, f"ended the process ({code}): {' '.join(printed[-1:])[:200]}", 0)


def _serve(connection: Connection, seed: int, folder: Path, readers: Readers) -> None:
    """Judges inputs on request; output of libraries goes to a file."""
    warnings.simplefilter("ignore")
    errors = os.open(folder / "stderr", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(errors, sys.stderr.fileno())
    os.dup2(errors, sys.stdout.fileno())
    by_name = readers()
    while True:
        try:
            name, number = connection.recv()
        except EOFError:
            return
        connection.send(judge(by_name[name], seed, number, folder))


@cache
def _has_peaks() -> bool:
    """True if the system reports a process's peak memory and can reset it."""
    return os.access("/proc/self/clear_refs", os.W_OK)


def _forget_peak() -> None:
    if _has_peaks():
        Path("/proc/self/clear_refs").write_text("5")


def _peak() -> int:
    return _status("self", "VmHWM") if _has_peaks() else 0


def _resident(process: int | None) -> int:
    return _status(str(process), "VmRSS") if _has_peaks() else 0


def _status(process: str, key: str) -> int:
    """A line of Linux's status of a process, MB; 0 if it has ended."""
    with suppress(OSError):
        for line in Path(f"/proc/{process}/status").read_text().splitlines():
            if line.startswith(key):
                return int(line.split()[1]) // 1000
    return 0
