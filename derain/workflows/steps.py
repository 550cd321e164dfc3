"""What a long work shows while it runs: each step, and its result with the time that it took."""

import time
from collections.abc import Callable

# Receives the lines to show.
Show = Callable[[str], None]


def show_nothing(text: str) -> None:
    """Drops the lines."""


class Steps:
    """Shows steps and their results.

    Args:
        show: Receives each line.
        total: Number of all steps.
    """

    def __init__(self, show: Show, total: int) -> None:
        self.show = show
        self._total = total
        self._begun = 0
        self._start = self._step = time.monotonic()

    def begin(self, title: str) -> None:
        """Shows what the next step does, and how many steps there are."""
        self._begun += 1
        self.show(f"{title} (step {self._begun} of {self._total})")
        self._step = time.monotonic()

    def end(self, result: str) -> None:
        """Shows the result of the step, and its time."""
        self.show(f"  {clock(time.monotonic() - self._step)}  {result}")

    @property
    def elapsed(self) -> str:
        """Time since the first step, as minutes and seconds."""
        return clock(time.monotonic() - self._start)


def clock(seconds: float) -> str:
    """A time as minutes and seconds."""
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d}"
