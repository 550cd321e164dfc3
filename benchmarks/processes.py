"""Commands of derain as processes: started in sessions of their own, looked for, and ended."""

import os
import signal
import subprocess
import sysconfig
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

# The command that is installed beside this Python. Not a module of it: Lightning starts the command
# again for each further process.
DERAIN = Path(sysconfig.get_path("scripts")) / "derain"


def started(command: Sequence[str | Path], **options: Any) -> subprocess.Popen[bytes]:
    """Starts a command in a session of its own, with no more than one thread a library.

    Args:
        command: The program and its arguments.
        options: Further options of ``subprocess.Popen``; ``env`` adds to the environment.
    """
    environment = {**os.environ, "OMP_NUM_THREADS": "1", **options.pop("env", {})}
    return subprocess.Popen(command, env=environment, start_new_session=True, **options)


def of_session(session: int) -> dict[int, str]:
    """Command lines of the processes of a session, by their ids; Linux only."""
    found = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            state, _, _, of = (folder / "stat").read_text().rpartition(") ")[2].split()[:4]
            if int(of) == session and state != "Z":
                found[int(folder.name)] = (folder / "cmdline").read_text().replace("\0", " ")
        except OSError:
            continue  # it ended meanwhile
    return found


def end_session(session: int, notice: float) -> list[str]:
    """Waits for the processes of a session, and kills those that go on.

    Args:
        session: The session.
        notice: Seconds to wait.

    Returns:
        Command lines of those that were killed.
    """
    give_up = time.monotonic() + notice
    while (processes := of_session(session)) and time.monotonic() < give_up:
        time.sleep(0.2)
    for process in processes:
        os.kill(process, signal.SIGKILL)
    return list(processes.values())
