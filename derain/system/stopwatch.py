"""Milliseconds by stage."""

import time
from collections.abc import Iterator
from contextlib import contextmanager


class Stopwatch:
    """Adds up the wall time of named stages; time in a nested stage counts for that stage alone.

    Attributes:
        milliseconds: Time spent so far, by stage, in the order in which the stages first ended.
    """

    def __init__(self) -> None:
        self.milliseconds: dict[str, float] = {}
        self._within = 0.0  # spent in stages within the one that goes on

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Times what happens inside the ``with`` block, also where it raises."""
        outer, self._within = self._within, 0.0
        start = time.perf_counter()
        try:
            yield
        finally:
            elapsed = 1e3 * (time.perf_counter() - start)
            self.milliseconds[name] = self.milliseconds.get(name, 0.0) + elapsed - self._within
            self._within = outer + elapsed
