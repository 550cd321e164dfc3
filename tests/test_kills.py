"""A short round of benchmarks/kills.py, and proof that its judge sees what it is to judge."""

import random
import shutil
import subprocess
import sys
import time
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest

from benchmarks import kills

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="it looks for processes in /proc")


def test_a_killed_command_leaves_whole_files_and_can_be_run_again(tmp_path) -> None:
    inputs = kills.SmallInputs(tmp_path / "inputs")
    victim = kills.undisturbed(kills.COMMANDS["fuse"](inputs), tmp_path / "undisturbed")
    generator = random.Random(0)
    for number, again in enumerate((False, True)):
        assert kills.kill_once(victim, generator, tmp_path / f"kill {number}", again) == []
    assert victim.counts["kills"] == 2
    assert victim.counts["failed again"] == 0


@pytest.fixture
def victim(tmp_path) -> kills.Victim:
    """A command that has written a file of each kind, undisturbed."""
    out = tmp_path / "undisturbed" / "out"
    out.mkdir(parents=True)
    (tmp_path / "undisturbed" / "tmp").mkdir()
    np.zeros(100, "<u4").tofile(out / "0.label")
    np.savez(out / "0.npz", xyz=np.zeros((100, 3), np.float32))
    (out / "report.json").write_text('{"scans": 3}\n')
    (out / "best.yaml").write_text("method: dsor\n")
    (out / "table.md").write_text("| method |\n")
    plt.imsave(out / "picture.png", np.random.default_rng(0).random((50, 50)))
    return kills.Victim([], tmp_path / "undisturbed")


@pytest.mark.parametrize(
    ("name", "left"),
    [
        *(("0.label", 200), ("0.npz", 300), ("report.json", 5), ("best.yaml", 0)),
        *(("table.md", 4), ("picture.png", 1000)),
    ],
)
def test_a_file_that_is_cut_short_is_found(victim, tmp_path, name, left) -> None:
    shutil.copytree(tmp_path / "undisturbed", tmp_path / "kill")
    assert kills.half_written(victim, tmp_path / "kill", complete=True) == []
    file = tmp_path / "kill/out" / name
    file.write_bytes(file.read_bytes()[:left])
    (fault,) = kills.half_written(victim, tmp_path / "kill", complete=True)
    assert fault.startswith(f"{name}: ")
    file.unlink()
    assert kills.half_written(victim, tmp_path / "kill", complete=False) == []
    assert kills.half_written(victim, tmp_path / "kill", complete=True) == [f"{name} is missing"]


def test_what_is_left_lying_about_or_running_is_found(victim, tmp_path) -> None:
    shutil.copytree(tmp_path / "undisturbed", tmp_path / "kill")
    assert kills.temporary_files(victim, tmp_path / "kill") == []
    (tmp_path / "kill/out/.derain-0.bin").touch()
    (tmp_path / "kill/tmp/x").touch()
    assert len(kills.temporary_files(victim, tmp_path / "kill")) == 2
    with subprocess.Popen(["sleep", "600"], start_new_session=True) as process:
        while not Path(f"/proc/{process.pid}/cmdline").read_bytes():
            time.sleep(0.01)  # it is not that program yet
        assert kills.end_session(process.pid, 0) == ["sleep 600 "]
        process.wait()
        assert kills.end_session(process.pid, 0) == []
