"""How far a job is: how many of its units are done, which failed, and which are missing."""

from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass

from derain.jobs.job import Job
from derain.jobs.shard import array_expression, shard_numbers
from derain.jobs.unit import Record, Unit
from derain.stores.url import Place


@dataclass(frozen=True)
class JobStatus:
    """How far a job is.

    Attributes:
        job: The job.
        units: All of its units, in order.
        done: Number of units that are done.
        failed: Records of the units that failed.
        missing: The units without a record.
        seconds: Time that the units took, by worker.
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
        seconds[record.worker] += record.seconds
        if record.errors:
            failed.append(record)
        else:
            on_done(record)
    done = len(units) - len(failed) - len(missing)
    return JobStatus(job, units, done, failed, missing, seconds)
