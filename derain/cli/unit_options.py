"""Options of commands that divide their work into units: processes, machines, and records."""

import argparse
from collections.abc import Callable
from contextlib import AbstractContextManager

from derain.cli.options import count
from derain.errors import InputError
from derain.jobs.running import Submits
from derain.jobs.shard import TASK, Shard
from derain.jobs.workers import processes
from derain.recordings.posed import with_poses
from derain.sources.method import Method
from derain.sources.source import Source
from derain.sources.units import BLOCK, Division, units_of
from derain.system.cores import threads_of
from derain.system.memory import total_memory
from derain.system.notices import warn

# The options that :func:`add_units` declares: how the work is divided changes no result.
UNIT_OPTIONS = ("workers", "dask", "shard", "resume", "anew", "block")

# Where the number of workers is not given, each has at least this many units: none waits for long.
UNITS_OF_WORKER = 4

# Bytes that a worker may take: scans of a million points take .8 GB.
MEMORY_OF_WORKER = 2 * 10**9


def add_units(
    parser: argparse.ArgumentParser, workers: str = "one per thread for many scans, else 1"
) -> None:
    """Declares the options of commands that judge many scans.

    Args:
        parser: The command's parser.
        workers: The default number of processes, as text of the help.
    """
    group = parser.add_argument_group("many scans")
    add_executor(group, f"processes, which share the threads (default: {workers})")
    add_shard(group)
    group.add_argument(
        "--resume",
        action="store_true",
        help="go on where an earlier run was stopped (default where --out has records of it, which "
        f"runs of more than {BLOCK} scans keep)",
    )
    group.add_argument(
        "--anew", action="store_true", help="do everything again, even with other options"
    )
    group.add_argument(
        "--block",
        type=count,
        default=BLOCK,
        metavar="SCANS",
        help="scans per unit of a long recording (default: %(default)s)",
    )


def add_executor(group: "argparse._ArgumentGroup", workers: str) -> None:
    """Declares the options of :func:`executor_of`.

    Args:
        group: Group to declare the options in.
        workers: Help of ``--workers``.
    """
    group.add_argument("--workers", type=count, metavar="N", help=workers)
    group.add_argument(
        "--dask",
        metavar="ADDRESS",
        help="workers of a Dask cluster: address of its scheduler, or the scheduler's file",
    )


def add_shard(group: "argparse._ArgumentGroup") -> None:
    """Declares the option of :func:`shard_of`."""
    group.add_argument(
        "--shard",
        metavar="I/N",
        help="process shard I of N, from 0 on (default: from SLURM_ARRAY_TASK_ID, if set)",
    )


def shard_of(arguments: argparse.Namespace) -> Shard | None:
    """The shard of the work to do, with a warning if it comes from SLURM alone; None for all.

    Raises:
        InputError: No such shard.
    """
    named = arguments.shard
    found = Shard.of_environment() if named is None else Shard.of_text(named)
    if found is not None and found.of_array:
        warn(
            f"{TASK} is {found.number + found.first}: "
            "only one shard is processed; --shard 0/1 processes all"
        )
    return found


def division_of(arguments: argparse.Namespace) -> Division:
    """The division of the work by the arguments.

    Raises:
        InputError: Options that exclude each other.
    """
    of_shard = shard_of(arguments)
    if arguments.anew and of_shard is not None:
        reason = "excludes shards of the work"
        raise InputError("--anew", reason, "Give --out another folder instead.")
    keep = arguments.resume or arguments.workers is not None or arguments.dask is not None
    return Division(arguments.block, of_shard, keep, arguments.anew)


def _workers_of(arguments: argparse.Namespace, method: Method, source: Source) -> int:
    """The number of processes.

    Unless it is named, there are as many as threads where each has several units to do: they are
    faster then, also on two cores (BENCHMARK.md). Otherwise there is one, as in a shard of the
    work, of which a batch system may start several on a machine.
    """
    if arguments.workers is not None:
        return int(arguments.workers)
    if arguments.dask is not None or arguments.shard or Shard.of_environment():
        return 1
    cores = threads_of(arguments.threads)
    fitting = min(cores, total_memory() // MEMORY_OF_WORKER)
    if fitting <= 1:
        return 1
    units = units_of(source, method, arguments.block)
    return fitting if len(units) >= UNITS_OF_WORKER * fitting else 1


def share_threads(arguments: argparse.Namespace, workers: int) -> bool:
    """Divides the threads of the arguments between workers; returns whether there are several.

    A worker of Dask does a unit in each of its threads: it has one thread, unless others are named.

    Args:
        arguments: The options, whose threads are changed.
        workers: Number of processes of this machine.
    """
    if workers == 1 and arguments.dask is None:
        return False
    shared = 1 if arguments.dask and not arguments.threads else threads_of(arguments.threads)
    arguments.threads = max(shared // workers, 1)
    return True


def prepared(source: Source, arguments: argparse.Namespace) -> Source:
    """The scans with their intensities scaled, and with poses.

    Args:
        source: The scans.
        arguments: The options that name the scale and the poses.

    Raises:
        InputError: Poses that cannot be read or do not fit the scans.
    """
    return with_poses(source, arguments.poses).map(
        lambda frame: frame.with_intensity_times(arguments.intensity_scale)
    )


def method_and_workers(
    method: Method, remake: Callable[[], Method], source: Source, arguments: argparse.Namespace
) -> tuple[Method, int]:
    """The method with the threads of a worker, and the number of workers.

    Args:
        method: The method with the threads of the arguments.
        remake: Makes it again, of changed arguments.
        source: The scans.
        arguments: The options.
    """
    workers = _workers_of(arguments, method, source)
    return (remake() if share_threads(arguments, workers) else method), workers


def executor_of(
    arguments: argparse.Namespace, workers: int
) -> AbstractContextManager[Submits | None]:
    """Lends the processes that do the work; None where this process does it.

    Args:
        arguments: The options.
        workers: Number of processes of this machine.

    Raises:
        InputError: Options that exclude each other, or a cluster that cannot do the work.
    """
    if arguments.dask is None:
        return processes(workers)
    if arguments.workers is not None:
        raise InputError("--workers", "excludes --dask", "Leave one of them out.")
    from derain.jobs.cluster import dask_executor  # imports Dask

    return dask_executor(arguments.dask)
