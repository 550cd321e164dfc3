"""Cores that this process may use, and threads that share them."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from numbers import Integral
from pathlib import Path, PurePosixPath
from typing import Any

from derain.errors import InputError

# Where Linux lists the control groups of a process, of version 1 or 2, and where they are mounted.
MEMBERSHIP = Path("/proc/self/cgroup")
GROUPS = Path("/sys/fs/cgroup")

# Files of a group, by version, that state its quota and its period: how many microseconds of
# processor time in how many; no limit is -1 in version 1, and ``max`` in version 2.
# Source: Linux, Documentation/scheduler/sched-bwc.rst; Documentation/admin-guide/cgroup-v2.rst.
QUOTA_FILES = (("cpu.cfs_quota_us", "cpu.cfs_period_us"), ("cpu.max",))

# The most threads that may be asked for. Each takes memory, and a million take all of it.
MOST_THREADS = 1024

# How OpenMP's threads wait, which it reads once, when it is loaded.
# Source: OpenMP 5.2, 21.7, OMP_WAIT_POLICY.
WAIT_POLICY = "OMP_WAIT_POLICY"


def usable_cores() -> int:
    """Cores this process may use, at least one.

    They are the cores that it may run on, and in a container with limited processor time no more
    than that time keeps busy, rounded up: further threads would only wait.
    """
    return max(1, min([_allowed_cores(), *_quotas()]))


def threads_of(threads: Any) -> int:
    """Number of threads for a user's option, in which 0 means one per core.

    Raises:
        InputError: Anything but a whole number from 0 to MOST_THREADS.
    """
    if not isinstance(threads, Integral) or threads < 0:
        reason = f"{threads!r} is not a whole number from 0 on"
    elif int(threads) > MOST_THREADS:
        reason = f"{threads} are more than {MOST_THREADS:,}"
    else:
        return int(threads) or usable_cores()
    raise InputError("threads", reason, "Give 0 for every core.")


@contextmanager
def sleeping_threads() -> Iterator[None]:
    """Makes the OpenMP threads of libraries imported inside sleep while they wait.

    By default they spin for milliseconds after each search, on the cores that a network needs.
    Libraries imported before or after are not affected, and a value that the user has set in the
    environment is kept.
    """
    if WAIT_POLICY in os.environ:
        yield
        return
    os.environ[WAIT_POLICY] = "passive"
    try:
        yield
    finally:
        del os.environ[WAIT_POLICY]


def _allowed_cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _quotas() -> Iterator[int]:
    """Cores that each group's quota keeps busy; a missing or malformed file sets none."""
    for group in _groups():
        for files in QUOTA_FILES:
            with suppress(OSError, ValueError):  # ValueError: no limit, ``max``, is no number
                words = " ".join((group / file).read_text("utf-8") for file in files).split()
                quota, period = map(int, words)
                if quota > 0 and period > 0:
                    yield -(-quota // period)


def _groups() -> Iterator[Path]:
    """The control groups that may limit the process's time: its own, and all that hold those.

    In a container a path may be that on the machine, while the folder of the container's own group
    is mounted at the top. The top is one of the groups that are looked at.
    """
    with suppress(OSError, ValueError):
        for line in MEMBERSHIP.read_text("utf-8").splitlines():
            _, controllers, path = line.split(":", 2)  # of version 2 if it names no controllers
            if not controllers or "cpu" in controllers.split(","):
                own = PurePosixPath(path.lstrip("/"))
                for group in (own, *own.parents):
                    yield GROUPS / controllers / group
