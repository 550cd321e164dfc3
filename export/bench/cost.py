"""The cost of a method in deployment: milliseconds by stage, and memory.

Each method is measured alone, in a fresh process without torch: no search for neighbours is shared,
no other method's memory is counted, and a crash affects that method alone. As in ``derain run``,
the memory of one scan serves the next.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from derain.errors import InputError, reason_of
from derain.export.bench.bench_entries import BenchEntry
from derain.export.timing import RunTimes, timed_runs
from derain.jobs.workers import WorkerPool
from derain.sources.frame import Frame


@dataclass(frozen=True)
class Effort:
    """The amount of timing, and the seed.

    Attributes:
        threads: Threads of views and networks; 0 takes every core this process may use.
        timed: Scans that each method is timed on, at most, spread evenly.
        repeats: Timed runs on each of them.
        seed: Random seed of the bootstrap intervals.

    Raises:
        InputError: No scan, or no run, to time.
    """

    threads: int = 0
    timed: int = 10
    repeats: int = 3
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("timed", "repeats"):
            if (number := getattr(self, name)) < 1:
                raise InputError(name, f"{number} is too few", "Give 1 or more.")


@dataclass(frozen=True)
class Cost:
    """Milliseconds and memory of one method.

    Attributes:
        times: Milliseconds of each run.
        peak_memory: Largest resident memory of a process that does this alone, in MiB, Python and
            its libraries included; None where it is not known, or the method could not be sent to
            another process, and was timed in this.
        failure: The error that stopped it, if any; there are no runs then.
    """

    times: RunTimes
    peak_memory: float | None
    failure: str | None = None


def measure_cost(bench_entry: BenchEntry, frames: Sequence[Frame], effort: Effort) -> Cost:
    """Measures a method in a process of its own, or here where it cannot be sent to another.

    Args:
        bench_entry: The method.
        frames: Scans to time it on, one or more, in the unit of the methods.
        effort: Its threads, and the timed runs on each scan.
    """
    try:
        if not bench_entry.is_picklable:
            return replace(measure_in_process(bench_entry, frames, effort), peak_memory=None)
        with WorkerPool(1) as pool:
            return pool.submit(measure_in_process, bench_entry, frames, effort).result()
    except Exception as error:  # its row states whatever a library raises
        return Cost(RunTimes.of_no_runs(), None, reason_of(error))


def measure_in_process(bench_entry: BenchEntry, frames: Sequence[Frame], effort: Effort) -> Cost:
    """Runs a method on every scan, in turns, in this process; see :func:`measure_cost`."""
    times = timed_runs(bench_entry.ready(effort.threads), frames, effort.repeats)
    return Cost(times, _peak_memory())


def _peak_memory() -> float | None:
    """Largest resident memory of this process so far, MiB.

    getrusage would not do: its value for a new process starts from the parent's memory.
    """
    try:
        lines = Path("/proc/self/status").read_text("utf-8").splitlines()
    except OSError:
        return None
    kibibytes = [int(line.split()[1]) for line in lines if line.startswith("VmHWM:")]
    return kibibytes[0] / 1024 if kibibytes else None
