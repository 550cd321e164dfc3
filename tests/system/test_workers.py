"""Processes that work for another end with it."""

import os
import subprocess
import sys
import threading

import pytest

from derain.system.workers import LAUNCHER, exit_with_launcher

HAS_A_WORKER = """
import time
from derain.jobs.workers import WorkerPool

if __name__ == "__main__":
    with WorkerPool(1) as pool:
        pool.submit(print, "at work", flush=True).result()
        pool.submit(time.sleep, 600).result()
"""

HAS_A_RANK = """
import os, subprocess, sys, time
from derain.system.workers import exit_with_launcher

exit_with_launcher()
if "LOCAL_RANK" in os.environ:
    print("at work", flush=True)
    time.sleep(600)
os.environ["LOCAL_RANK"] = "0"  # as Lightning does, which then starts the others
subprocess.run([sys.executable, __file__], env={**os.environ, "LOCAL_RANK": "1"})
"""


# torchrun starts all processes of its machine, and leaves them alone when it is killed.
HAS_A_PROCESS_OF_TORCHRUN = """
import os, subprocess, sys, time
from derain.system.workers import exit_with_launcher

if "LOCAL_RANK" in os.environ:
    exit_with_launcher()
    print("at work", flush=True)
    time.sleep(600)
given = {"LOCAL_RANK": "0", "TORCHELASTIC_RUN_ID": "none"}
subprocess.run([sys.executable, __file__], env={**os.environ, **given})
"""


@pytest.mark.parametrize(
    "program",
    [HAS_A_WORKER, HAS_A_RANK, HAS_A_PROCESS_OF_TORCHRUN],
    ids=["worker", "rank", "torchrun"],
)
def test_no_process_outlives_the_one_that_it_works_for(tmp_path, program) -> None:
    (tmp_path / "program.py").write_text(program)
    environment = {k: v for k, v in os.environ.items() if k != "LOCAL_RANK"}
    environment[LAUNCHER] = "1"  # as in a run that another run has begun
    command = [sys.executable, tmp_path / "program.py"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=environment
    ) as process:
        assert process.stdout.readline() == b"at work\n"
        process.kill()
        process.communicate(timeout=30)  # returns when nobody holds the other end of the pipe


@pytest.mark.parametrize("environment", [{}, {"LOCAL_RANK": "1"}], ids=["alone", "by hand"])
def test_a_process_that_nobody_of_ours_began_goes_on_without_its_parent(
    monkeypatch, environment
) -> None:
    monkeypatch.setattr(os, "environ", dict(environment))
    threads = threading.active_count()
    exit_with_launcher()
    assert threading.active_count() == threads
