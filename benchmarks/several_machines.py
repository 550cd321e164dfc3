"""Trains and measures on two machines that torchrun joins, beside one; Linux only.

    python -m benchmarks.several_machines WADS
    python -m benchmarks.several_machines WADS --networks outdet --kills 10

Both machines are this one: two agents of torchrun, of a process each, that meet at an address. WADS
holds sequence 36; networks train two epochs on its eight scans. Of each network is printed

- how far the weights from two machines are from those of two processes of one machine, and from
  those of one process with as many scans in a step, and their IoU;
- whether validate, test and predict give on two machines what they give in one process;
- how far a training that two machines began and one process ended is from the others;
- after kills of the agents at random moments: whether a process was left ten seconds later, and
  whether one process goes on from last.ckpt.
"""

import argparse
import itertools
import json
import os
import random
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import torch

from benchmarks.processes import DERAIN
from derain.evaluation.text_tables import markdown_table
from derain.export.timing import versions

NETWORKS = ("outdet", "salsanext", "lisnownet")
EPOCHS = 2
SCANS = "sequences/36/velodyne/*.bin"

# Seconds in which no process of a killed training may be left.
NOTICE = 10


@dataclass(frozen=True)
class Bench:
    """A network, and the folder that its runs go to.

    Attributes:
        network: Its name in a packaged configuration.
        root: The data set.
        folder: Where the commands run.
    """

    network: str
    root: Path
    folder: Path
    numbers: Iterator[int] = field(default_factory=itertools.count)

    def command(self, name: str, run: str, *options: str) -> list[str]:
        """A command of derain that writes to the folder of a run."""
        return [
            *(str(DERAIN), name, "--config", f"{self.network}_wads36.yaml"),
            *("--data.root", str(self.root.resolve()), "--data.test", f'["{SCANS}"]'),
            *("--trainer.accelerator", "cpu", "--trainer.enable_progress_bar", "false"),
            *("--panels.scans", "0"),
            *("--trainer.logger.name", run, *options),
        ]

    def run_one(self, name: str, run: str, *options: str) -> str:
        """Runs a command on this machine alone; returns what it printed."""
        finished = subprocess.run(
            self.command(name, run, *options), cwd=self.folder, capture_output=True, text=True
        )
        assert finished.returncode == 0, finished.stderr
        return finished.stdout

    @contextmanager
    def two_agents(self, name: str, run: str, *options: str) -> Iterator[list[subprocess.Popen]]:
        """Runs a command on two machines; yields their agents, which are killed at the end."""
        torchrun = [
            *(sys.executable, "-m", "torch.distributed.run", "--nnodes", "2"),
            *("--rdzv-backend", "c10d", "--rdzv-endpoint", f"localhost:{_free_port()}"),
            "--no-python",
        ]
        command = [*torchrun, *self.command(name, run, *options)]
        logs = [self.folder / f"{next(self.numbers)}.log" for _ in range(2)]
        agents = []
        for log in logs:
            with log.open("w") as file:
                agents.append(subprocess.Popen(command, cwd=self.folder, stdout=file, stderr=file))
        try:
            yield agents
        finally:
            for agent in agents:
                agent.kill()
                agent.wait()

    def run_two(self, name: str, run: str, *options: str) -> str:
        """Runs a command on two machines to its end; returns what the first one printed."""
        with self.two_agents(name, run, *options) as agents:
            codes = [agent.wait() for agent in agents]
        number = next(self.numbers)
        printed = [(self.folder / f"{number - back}.log").read_text() for back in (2, 1)]
        assert codes == [0, 0], "\n".join(printed)
        return "".join(printed)

    def checkpoint(self, run: str, name: str = "last") -> Path:
        """A checkpoint of a run's first training."""
        return self.folder / "runs" / run / "version_0/checkpoints" / f"{name}.ckpt"


def main() -> None:
    """Prints a table of the trainings, and one of the kills."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("root", type=Path, metavar="WADS")
    parser.add_argument("--networks", nargs="+", default=NETWORKS, choices=NETWORKS)
    parser.add_argument("--kills", type=int, default=4)
    arguments = parser.parse_args()

    os.environ["OMP_NUM_THREADS"] = "1"
    rows = []
    for network in arguments.networks:
        with tempfile.TemporaryDirectory() as folder:
            bench = Bench(network, arguments.root, Path(folder))
            rows += _trained(bench)
            rows += _measured(bench)
            rows += _killed(bench, arguments.kills)
    print(markdown_table(("network", "what", "found"), rows))
    print(versions())


def _trained(bench: Bench) -> list[tuple[str, str, str]]:
    epochs = ("--trainer.max_epochs", str(EPOCHS))
    one_process = (*epochs, "--data.loading.batch_size", "2")
    bench.run_two("fit", "machines", *epochs)
    bench.run_one("fit", "devices", *epochs, "--trainer.devices", "2")
    bench.run_one("fit", "one", *one_process)
    bench.run_two("fit", "begun", "--trainer.max_epochs", "1")
    begun = ("--ckpt_path", str(bench.checkpoint("begun")))
    bench.run_two("fit", "ended_by_two", *epochs, *begun)
    bench.run_one("fit", "ended_by_one", *one_process, *begun)
    machines = bench.checkpoint("machines")
    return [
        (bench.network, f"weights, two machines and {what}", _difference(machines, other))
        for what, run in {
            "two processes": "devices",
            "one process of twice the batch": "one",
            "two that stopped and went on": "ended_by_two",
            "two, ended by one process": "ended_by_one",
        }.items()
        for other in [bench.checkpoint(run)]
    ]


def _difference(one: Path, other: Path) -> str:
    first, second = (torch.load(path, weights_only=True) for path in (one, other))
    assert first["global_step"] == second["global_step"]
    weights = first["state_dict"]
    largest = max(
        float((weights[name].double() - tensor.double()).abs().max())
        for name, tensor in second["state_dict"].items()
        if tensor.is_floating_point() and tensor.numel()
    )
    return "equal" if largest == 0 else f"up to {largest:.2g} apart"


def _measured(bench: Bench) -> list[tuple[str, str, str]]:
    found = []
    for run_command, labels in ((bench.run_two, "two"), (bench.run_one, "one")):
        checkpoint = ("--ckpt_path", str(bench.checkpoint("machines", "best")))
        validated = run_command("validate", "validate", *checkpoint)
        run_command("test", f"test_{labels}", *checkpoint)
        run_command("predict", "predict", *checkpoint, "--predictions.folder", labels)
        report = bench.folder / f"runs/test_{labels}/version_0/test.json"
        found.append(
            {
                "validate": [line for line in validated.splitlines() if "val/" in line],
                "test": json.loads(report.read_text()),
                "predict": [
                    path.read_bytes() for path in sorted((bench.folder / labels).rglob("*.label"))
                ],
            }
        )
    two, one = found
    iou = one["test"]["scores"]["iou"]
    return [
        (bench.network, f"{name}, two machines and one process", _equal(two[name], one[name]))
        for name in one
    ] + [(bench.network, "IoU of two machines' best epoch", f"{iou:.6f}")]


def _equal(two: Sequence[object], one: Sequence[object]) -> str:
    assert one
    return "equal to the digit" if two == one else "DIFFERENT"


def _killed(bench: Bench, kills: int) -> list[tuple[str, str, str]]:
    """Kills an agent, either of the two, at random moments after the first epoch."""
    generator = random.Random(0)
    left, resumed = 0, 0
    for number in range(kills):
        run = f"killed{number}"
        with bench.two_agents("fit", run, "--trainer.max_epochs", "1000") as agents:
            while not bench.checkpoint(run).exists():
                time.sleep(0.1)
                assert agents[0].poll() is None, "it ended before its first epoch"
            time.sleep(generator.uniform(0, 5))
            at_work = [_children(agent.pid) for agent in agents]
            agents[generator.randrange(2)].send_signal(signal.SIGKILL)
            time.sleep(NOTICE)
            left += any(Path(f"/proc/{pid}").exists() for pids in at_work for pid in pids)
        epoch = torch.load(bench.checkpoint(run), weights_only=True)["epoch"]
        options = ("--trainer.max_epochs", str(epoch + 2), "--data.loading.batch_size", "2")
        bench.run_one("fit", f"again{number}", *options, "--ckpt_path", str(bench.checkpoint(run)))
        last = torch.load(bench.checkpoint(f"again{number}"), weights_only=True)
        resumed += last["epoch"] == epoch + 1
    return [
        (bench.network, "kills of an agent after which a process was left", f"{left} of {kills}"),
        (bench.network, "that one process went on from", f"{resumed} of {kills}"),
    ]


def _children(process: int) -> list[int]:
    listed = Path(f"/proc/{process}/task/{process}/children").read_text()
    return [int(word) for word in listed.split()]


def _free_port() -> int:
    with socket.create_server(("localhost", 0)) as server:
        return int(server.getsockname()[1])


if __name__ == "__main__":
    main()
