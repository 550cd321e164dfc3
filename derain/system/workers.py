"""Worker processes, which end with this one however it ends."""

import multiprocessing
import os
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType

# Environment variable with the id of the process that began a run on several devices, which the
# further processes that Lightning starts for the run watch.
LAUNCHER = "DERAIN_LAUNCHER"

# Threads that start processes at once would take each other's stand-in for the main module.
_starting = threading.Lock()


@contextmanager
def without_main_module() -> Iterator[None]:
    """Keeps processes that are started here from running the user's script again.

    A new process imports the module that the program began with, in case it defines what the
    process needs. Where it does not, that would only take time and memory; and a script that does
    not guard its work by ``if __name__ == "__main__"`` would do all of it again.
    """
    with _starting:
        main = sys.modules["__main__"]
        sys.modules["__main__"] = ModuleType("__main__")
        try:
            yield
        finally:
            sys.modules["__main__"] = main


def exit_with_launcher() -> None:
    """Ends this process when the one that began its run is gone, if that is another process.

    Lightning runs the command again for each further device, and torchrun for each device of its
    machine. If the first process or torchrun is killed, the others would wait for it. On Windows a
    lost parent is not detected.
    """
    if "TORCHELASTIC_RUN_ID" in os.environ:
        os.environ[LAUNCHER] = str(os.getppid())
    elif "LOCAL_RANK" not in os.environ:
        os.environ[LAUNCHER] = str(os.getpid())
    launcher = int(os.environ.get(LAUNCHER, os.getpid()))
    if launcher != os.getpid():
        threading.Thread(target=_watch, args=(launcher,), daemon=True).start()


def _watch(launcher: int) -> None:
    while os.getppid() == launcher:
        time.sleep(1)
    os._exit(1)


def end_with_parent() -> None:
    """Ends this process when the one that started it has ended, however it ended."""
    parent = multiprocessing.parent_process()
    assert parent is not None

    def watch() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
