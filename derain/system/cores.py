"""Cores that this process may use, and threads that share them."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from numbers import Integral
from pathlib import Path
from typing import Any

from derain.errors import InputError

# Where Linux has the limit of a container's processor time: how many microseconds of it in how
# many; no limit is ``max``.
# Source: Linux, Documentation/admin-guide/cgroup-v2.rst.
GROUP_LIMIT = Path("/sys/fs/cgroup/cpu.max")

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
    cores = _allowed_cores()
    with suppress(OSError, ValueError):  # ValueError: no limit, ``max``, is no number
        quota, period = map(int, GROUP_LIMIT.read_text("utf-8").split())
        cores = min(cores, -(-quota // max(period, 1)))
    return max(1, cores)


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
