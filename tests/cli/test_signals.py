"""A signal ends a command, which clears up and whose exit code names the signal."""

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from derain.cli import info
from derain.cli.main import main
from derain.cli.signals import ENDING, Interruption, interrupting
from derain.files.atomic import replacing

# `derain info` that writes its argument, slowly.
WRITES = """
import signal, sys, time
from pathlib import Path
from derain.cli import info
from derain.cli.main import main
from derain.files.atomic import replacing

def write(arguments):
    with replacing(Path(sys.argv[1])) as temporary:
        temporary.write_bytes(b"half")
        print("writing", flush=True)
        # A signal that comes right before a sleep is handled when the sleep ends.
        while True:
            time.sleep(0.01)

info.main = write
# Tests that run in the background, or by nohup, ignore what a terminal would send.
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGHUP, signal.SIG_DFL)
sys.exit(main(["info", "scan.bin"]))
"""


def stopped(path: Path, by: signal.Signals) -> tuple[int, str]:
    """Exit code and error output of a command that is stopped while it writes a file."""
    command = [sys.executable, "-c", WRITES, path]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout.readline() == "writing\n"
        process.send_signal(by)
        _, error = process.communicate(timeout=60)
    return process.returncode, error


@pytest.mark.parametrize("by", ENDING, ids=lambda by: by.name)
def test_a_command_that_a_signal_ends_leaves_nothing_half_written(tmp_path, by) -> None:
    path = tmp_path / "result.bin"
    path.write_bytes(b"old")
    name = "" if by == signal.SIGINT else f" by {by.name}"
    assert stopped(path, by) == (128 + by, f"derain: interrupted{name}\n")
    assert list(tmp_path.iterdir()) == [path]
    assert path.read_bytes() == b"old"


def test_a_signal_ends_a_command_in_which_a_class_is_being_made(monkeypatch, capsys) -> None:
    class Attribute:
        def __set_name__(self, owner: type, name: str) -> None:
            raise Interruption(signal.SIGTERM)

    # Before Python 3.12, the class raises a RuntimeError in its place.
    monkeypatch.setattr(info, "main", lambda _: type("Owner", (), {"attribute": Attribute()}))
    assert main(["info", "scan.bin"]) == 128 + signal.SIGTERM
    assert capsys.readouterr().err == "derain: interrupted by SIGTERM\n"


def test_what_a_killed_command_leaves_goes_with_the_next_and_what_is_in_use_stays(tmp_path) -> None:
    path = tmp_path / "result.bin"
    assert stopped(path, signal.SIGKILL) == (-signal.SIGKILL, "")
    (abandoned,) = tmp_path.iterdir()
    command = [sys.executable, "-c", WRITES, path]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "writing\n"
        (in_use,) = tmp_path.iterdir()
        assert in_use != abandoned
        with replacing(path) as temporary:
            temporary.write_bytes(b"new")
            assert set(tmp_path.iterdir()) == {in_use, temporary.parent}
        process.kill()
    assert set(tmp_path.iterdir()) == {in_use, path}


def test_signals_that_others_listen_to_are_left_to_them() -> None:
    before = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    try:
        with interrupting():
            signal.raise_signal(signal.SIGTERM)
        assert signal.getsignal(signal.SIGTERM) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGTERM, before)
    assert signal.getsignal(signal.SIGTERM) is before
