"""Two machines that torchrun joins do what one does."""

import os
import socket
import subprocess
import sys
from pathlib import Path

import torch
import yaml
from recorded_scenes import write_scenes

from . import two_machines

# Three steps of two scans, the last of them of one twice.
POINTS = (300, 40, 500, 120, 260)

CONFIG = Path("two.yaml")
RUN = Path("runs/two/version_0")


def write_data() -> None:
    """Writes labelled scenes, and the configuration of a training on them."""
    write_scenes(Path("scans"), *POINTS, rain=110)
    logger = {
        "class_path": "lightning.pytorch.loggers.TensorBoardLogger",
        "init_args": {"save_dir": "runs", "name": "two"},
    }
    parts = {part: ["*.bin"] for part in ("train", "validation", "test")}
    configuration = {
        "trainer": {
            "accelerator": "cpu",
            "max_epochs": 1,
            "enable_progress_bar": False,
            "logger": logger,
        },
        "model": {"class_path": "derain.models.outdet.OutDet"},
        "data": {
            "class_path": "derain.datamodules.folder.Folder",
            "init_args": {"root": "scans", "card": "wads", **parts},
        },
        "panels": {"scans": 0},
    }
    CONFIG.write_text(yaml.safe_dump(configuration))


def free_port() -> int:
    """A port on which nobody listens."""
    with socket.create_server(("localhost", 0)) as server:
        return int(server.getsockname()[1])


def run_two_machines(*arguments: str | Path) -> str:
    """Runs the program on two machines, both of them this one; returns what the first printed."""
    command = [
        *(sys.executable, "-m", "torch.distributed.run", "--nnodes", "2"),
        *("--rdzv-backend", "c10d", "--rdzv-endpoint", f"localhost:{free_port()}"),
        *(two_machines.__file__, *arguments),
    ]
    agents = [
        subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        for _ in range(2)
    ]
    printed = [agent.communicate(timeout=300)[0] for agent in agents]
    assert [agent.returncode for agent in agents] == [0, 0], "\n".join(printed)
    return "".join(printed)


def test_two_machines_train_together_and_find_what_one_finds(succeed) -> None:
    write_data()
    best = RUN / "checkpoints/best.ckpt"
    printed = run_two_machines(CONFIG, best)
    assert os.listdir("runs/two") == ["version_0"]  # of both machines, of fit and test
    last = torch.load(RUN / "checkpoints/last.ckpt", weights_only=True)
    assert last["global_step"] == 3
    # The run's own configuration is that of any number of machines.
    assert yaml.safe_load((RUN / "config.yaml").read_text())["trainer"]["num_nodes"] == 1

    together = (RUN / "test.json").read_text()
    alone = succeed("test", "--config", CONFIG, "--ckpt_path", best)
    assert alone.out in printed
    assert (RUN / "test.json").read_text() == together
