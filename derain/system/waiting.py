"""How threads of a library wait for each other."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

# What OpenMP asks when it is loaded, once and for all.
# Source: OpenMP 5.2, 21.7, OMP_WAIT_POLICY.
WAIT_POLICY = "OMP_WAIT_POLICY"


@contextmanager
def sleeping_threads() -> Iterator[None]:
    """Has the OpenMP threads of libraries that are imported inside sleep while they wait.

    By default they spin for milliseconds after each search, on the cores that the network is to
    compute on. Libraries imported before or after, and whoever has said otherwise in the
    environment, are left alone.
    """
    if WAIT_POLICY in os.environ:
        yield
        return
    os.environ[WAIT_POLICY] = "passive"
    try:
        yield
    finally:
        del os.environ[WAIT_POLICY]
