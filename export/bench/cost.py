"""What a method costs where it is deployed: milliseconds by stage, and memory.

Each method is measured alone, in a fresh process that loads nothing of torch: no search for
neighbours is shared, no other method's memory is counted, and a crash is that method's alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from derain.export.bench.contestants import Contestant
from derain.export.timing import STAGES, timed_runs
from derain.files import DEFAULT_COLUMNS
from derain.scan import Scan
from derain.system.stopwatch import Stopwatch
from derain.system.workers import worker_pool

WARM_UP = 2


@dataclass(frozen=True)
class Timing:
    """How methods are timed.

    Attributes:
        scans: Scans to time them on, one or more.
        columns: Names of the columns of scans that do not name them.
        threads: Threads of view and network; 0 takes every core this process may use.
        repeats: Timed runs on each scan.
        intensity_scale: What takes the scans' intensities to the unit of the methods.
    """

    scans: Sequence[Path]
    columns: Sequence[str] = DEFAULT_COLUMNS
    threads: int = 0
    repeats: int = 3
    intensity_scale: float = 1.0


@dataclass(frozen=True)
class Cost:
    """Milliseconds and memory of one method.

    Attributes:
        milliseconds: Time of each run by stage, float64 (runs,); 0 in stages that it has not.
        peak_memory: Largest resident memory of a process that does this alone, in MiB, Python and
            its libraries included; None where the system does not tell.
        failure: What went wrong, if anything did; there are no runs then.
    """

    milliseconds: dict[str, NDArray[np.float64]]
    peak_memory: float | None
    failure: str | None = None

    def percentile(self, percentage: float, stage: str | None = None) -> float:
        """Milliseconds that a share of the runs stay within, of one stage or of all together.

        Not a number where nothing was run.
        """
        times = sum(self.milliseconds.values()) if stage is None else self.milliseconds[stage]
        return float(np.percentile(times, percentage)) if np.size(times) else float("nan")


def measure_cost(contestant: Contestant, timing: Timing) -> Cost:
    """Measures a method in a process of its own.

    Args:
        contestant: The method.
        timing: What it is timed on, and how.
    """
    with worker_pool(1) as pool:
        try:
            return pool.submit(run_alone, contestant, timing).result()
        except Exception as error:  # whatever its libraries raise is told in the method's row
            return Cost({stage: np.zeros(0) for stage in STAGES}, None, str(error))


def run_alone(contestant: Contestant, timing: Timing) -> Cost:
    """Runs a method on every scan, in turns, in this process; see :func:`measure_cost`."""
    method = contestant.ready(timing.threads)

    def judge(scan: Scan, stopwatch: Stopwatch) -> NDArray[np.bool_]:
        return method(scan.with_intensity_times(timing.intensity_scale), stopwatch)

    times = timed_runs(judge, timing.scans, timing.columns, WARM_UP, timing.repeats)
    return Cost(times, _peak_memory())


def _peak_memory() -> float | None:
    """Largest resident memory of this process so far, MiB.

    Not getrusage's: what it says of a new process begins with the memory of the one that began it.
    """
    try:
        lines = Path("/proc/self/status").read_text("utf-8").splitlines()
    except OSError:
        return None
    kibibytes = [int(line.split()[1]) for line in lines if line.startswith("VmHWM:")]
    return kibibytes[0] / 1024 if kibibytes else None
