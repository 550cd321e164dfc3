"""Times the parts of a training: reading, viewing and the step of each network, and epochs.

    python benchmarks/training.py WADS
    python benchmarks/training.py WADS --networks outdet --epochs 8

WADS holds sequence 36. Scans per second are those of eight scans, medians of rounds; the step is
forward, backward and optimiser. Seconds of processor time an epoch are those of `derain fit` and
its workers, from the difference of two trainings, so that what happens once does not count.
"""

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module
from importlib.resources import files
from pathlib import Path
from typing import Any

import lightning
import numpy as np
import torch
import yaml
from jsonargparse import ArgumentParser

from derain.datamodules.base import ScanDataModule
from derain.datamodules.order import Pick
from derain.export.timing import versions
from derain.learning.batch import Batch
from derain.learning.task import agree_on_task
from derain.models.base import DerainingModule
from derain.workflows.training import KEPT_IN_TRAINING, keep_freed_memory

NETWORKS = ("outdet", "salsanext", "lisnownet")
WORKERS = (0, 1, 2)
SCANS = 8  # that an epoch has
# The packaged configurations train for so many epochs, of which one in six or seven is drawn; so
# is one of those that are timed.
EPOCHS, TIMED = 60, 7


@dataclass(frozen=True)
class Training:
    """A network and its data, as a packaged configuration describes them."""

    model: DerainingModule
    data: ScanDataModule
    precision: str

    @classmethod
    def of(cls, network: str, root: Path, workers: int) -> "Training":
        """Agrees on the training of a network on sequence 36."""
        text = files("derain.configs").joinpath(_configuration(network)).read_text()
        described = yaml.safe_load(text)
        described["data"]["init_args"]["root"] = str(root)
        described["data"]["init_args"].setdefault("loading", {})["workers"] = workers
        parts = {part: _made(described[part]) for part in ("model", "data")}
        agree_on_task(parts["model"], parts["data"])
        return cls(**parts, precision=described["trainer"].get("precision", "32-true"))


def main() -> None:
    """Prints a line for each network and number of workers."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("root", type=Path, metavar="WADS")
    parser.add_argument("--networks", nargs="+", default=NETWORKS, choices=NETWORKS)
    parser.add_argument("--workers", nargs="+", default=WORKERS, type=int)
    parser.add_argument("--epochs", type=int, default=TIMED, help="that are timed of `derain fit`")
    arguments = parser.parse_args()

    _prepare()
    print("network    workers   read   view   step   loader  scans/s    fit: s/epoch  CPU s/epoch")
    for network in arguments.networks:
        stages = _scans_per_second(Training.of(network, arguments.root, 0))
        for workers in arguments.workers:
            loader = _loader_rate(Training.of(network, arguments.root, workers))
            wall, cpu = _epoch(network, arguments.root, workers, arguments.epochs)
            rates = "".join(f"{rate:7.1f}" for rate in stages)
            print(
                f"{network:12}{workers:6} {rates}{loader:9.1f}{wall:24.2f}{cpu:13.2f}", flush=True
            )
    print(versions())


def _prepare() -> None:
    """Does what `derain fit` does before it trains."""
    lightning.seed_everything(0, verbose=False)
    keep_freed_memory(KEPT_IN_TRAINING)
    torch.use_deterministic_algorithms(True, warn_only=True)
    torch.utils.deterministic.fill_uninitialized_memory = False


def _scans_per_second(training: Training) -> list[float]:
    """Of reading a scan, of augmenting and viewing it, and of a step, each alone."""
    dataset: Any = training.data.train_dataloader().dataset
    scans = range(len(dataset))
    reading = _rate(lambda number: dataset.read(dataset.frames[number]), scans)
    for number in scans:  # what was read is kept
        dataset[Pick(number)]
    viewing = _rate(lambda number: dataset[Pick(number)], scans)
    batches = [Batch.of([dataset[Pick(number)]]) for number in scans]
    step = _step_of(training)
    return [reading, viewing, _rate(lambda number: step(batches[number]), scans)]


def _step_of(training: Training) -> Callable[[Batch], None]:
    optimizer: Any = torch.optim.Adam(training.model.parameters(), lr=1e-4)
    training.model.train()

    def step(batch: Batch) -> None:
        with torch.autocast("cpu", torch.bfloat16, enabled=training.precision == "bf16-mixed"):
            losses, _ = training.model.losses(batch)
        optimizer.zero_grad()
        losses["loss"].backward()
        optimizer.step()

    return step


def _loader_rate(training: Training) -> float:
    """Of what the loader gives where nobody else wants the cores, after the first epoch."""
    loader = training.data.train_dataloader()
    for _ in loader:
        pass
    start = time.perf_counter()
    for _ in loader:
        pass
    return SCANS / (time.perf_counter() - start)


def _rate(work: Callable[[int], object], scans: range, rounds: int = 3) -> float:
    seconds = []
    for _ in range(rounds):
        start = time.perf_counter()
        for number in scans:
            work(number)
        seconds.append((time.perf_counter() - start) / len(scans))
    return float(1 / np.median(seconds))


def _epoch(network: str, root: Path, workers: int, epochs: int) -> tuple[float, float]:
    """Seconds of an epoch of `derain fit`: that passed, and of processors."""
    first, all_ = (np.array(list(_fit(network, root, workers, n))) for n in (1, 1 + epochs))
    wall, cpu = (all_ - first) / epochs
    return float(wall), float(cpu)


def _fit(network: str, root: Path, workers: int, epochs: int) -> Iterator[float]:
    before, start = _of_children(), time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        options = {
            "config": _configuration(network),
            "data.root": str(root),
            "data.loading.workers": str(workers),
            "trainer.max_epochs": str(EPOCHS),
            "trainer.max_steps": str(SCANS * epochs),
            "trainer.enable_progress_bar": "false",
            "trainer.logger.save_dir": folder,
        }
        command = [sys.executable, "-c", "from derain.cli.main import main; main()", "fit"]
        for name, value in options.items():
            command += [f"--{name}", value]
        subprocess.run(command, check=True, capture_output=True)
    yield time.perf_counter() - start
    yield _of_children() - before


def _of_children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _configuration(network: str) -> str:
    return f"{network}_wads36.yaml"


def _made(described: dict[str, Any]) -> Any:
    module, name = described["class_path"].rsplit(".", 1)
    parser = ArgumentParser()
    parser.add_class_arguments(getattr(import_module(module), name), "it")
    return parser.instantiate(parser.parse_object({"it": described["init_args"]})).it


if __name__ == "__main__":
    main()
