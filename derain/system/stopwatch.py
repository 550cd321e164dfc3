"""How long each part of a piece of work takes."""

import time
from collections.abc import Iterator
from contextlib import contextmanager


class Stopwatch:
    """Seconds of parts of a piece of work, by name; of a part within a part, to the inner one.

    Attributes:
        seconds: What was timed so far, wall-clock seconds by the name of the part.
    """

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._part: str | None = None  # what runs by now
        self._since = 0.0

    @contextmanager
    def times(self, part: str) -> Iterator[None]:
        """Times the block as one part; what it interrupts goes on being timed after it."""
        outer = self._part
        self._turn_to(part)
        try:
            yield
        finally:
            self._turn_to(outer)

    def _turn_to(self, part: str | None) -> None:
        now = time.perf_counter()
        if self._part is not None:
            self.seconds[self._part] = self.seconds.get(self._part, 0.0) + now - self._since
        self._part, self._since = part, now
