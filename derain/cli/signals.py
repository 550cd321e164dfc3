"""Signals that end a command: they interrupt it, so that it cleans up."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

ENDING = [
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
]


class Interruption(KeyboardInterrupt):
    """A signal that ends the command. Libraries treat it as Ctrl-C.

    Args:
        signal: The signal.
    """

    def __init__(self, signal: signal.Signals) -> None:
        super().__init__()
        self.signal = signal


@contextmanager
def interrupting() -> Iterator[None]:
    """Raises :class:`Interruption` in the block when a signal is to end the command.

    A second one ends the process at once, as if this were not there. Signals that somebody else
    listens to, or that are to be ignored, as after ``nohup``, are left to them.
    """
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread receives signals
        return
    found = {number: signal.getsignal(number) for number in ENDING}
    ours = {
        number: handler
        for number, handler in found.items()
        if handler in (signal.SIG_DFL, signal.default_int_handler)
    }

    def interrupt(number: int, _: FrameType | None) -> None:
        restore()
        raise Interruption(signal.Signals(number))

    def restore() -> None:
        for number, handler in ours.items():
            signal.signal(number, handler)

    for number in ours:
        signal.signal(number, interrupt)
    try:
        yield
    finally:
        restore()
