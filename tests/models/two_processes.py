"""Trains, measures and predicts on two processes, in an interpreter of its own.

The two are forked, for processes that start anew would take seconds each to load torch; and a
process may only be forked before anything in it has made threads.

    python two_processes.py SCANS
"""

import json
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import lightning
import torch
from lightning.pytorch.callbacks import ModelCheckpoint
from lightning.pytorch.loggers import CSVLogger

from derain.datamodules.base import Loading
from derain.datamodules.folder import Folder
from derain.models.base import DerainingModule
from derain.models.callbacks.prediction import PredictionWriter
from derain.models.callbacks.report import TestReport
from derain.models.checkpoint import load_model
from derain.models.lisnownet import LiSnowNet
from derain.models.measured import MONITOR
from derain.models.outdet import OutDet

GRID = {"rows": 16, "columns": 64, "inclination": [-30.0, 20.0]}
NETWORKS: Mapping[str, Callable[[], DerainingModule]] = {
    "outdet": OutDet,
    "lisnownet": lambda: LiSnowNet(grid=GRID, width=2),
}


def data_of(folder: Path) -> Folder:
    """The scans of a folder, two in a batch, the same ones for every part."""
    parts = {part: ["*.bin"] for part in ("train", "validation", "test")}
    return Folder(str(folder), "wads", **parts, loading=Loading(batch_size=2))


def make_trainer(folder: Path, processes: int, *callbacks: lightning.Callback) -> Any:
    """A trainer that logs to ``log<processes>``."""
    return lightning.Trainer(
        accelerator="cpu",
        devices=processes,
        strategy="auto" if processes == 1 else "ddp_fork",
        max_epochs=1,
        deterministic=True,
        callbacks=[*callbacks],
        logger=CSVLogger(folder, f"log{processes}", ""),
        enable_checkpointing=any(isinstance(one, ModelCheckpoint) for one in callbacks),
        enable_progress_bar=False,
        enable_model_summary=False,
    )


def fit(scans: Path, folder: Path) -> float:
    """Trains the network that a folder is named after; returns what ``best.ckpt`` was chosen by."""
    lightning.seed_everything(0)
    best = ModelCheckpoint(folder, filename="best", monitor=MONITOR, mode="max")
    trainer = make_trainer(folder, 2, best)
    trainer.fit(NETWORKS[folder.name](), data_of(scans))
    return float(trainer.callback_metrics[MONITOR])


def measure(scans: Path, folder: Path, processes: int) -> dict[str, Any]:
    """Validates, tests and predicts with ``best.ckpt``; returns every score."""
    model, data = load_model(folder / "best.ckpt"), data_of(scans)
    (validated,) = make_trainer(folder, processes).validate(model, data)
    (tested,) = make_trainer(folder, processes, TestReport()).test(model, data)
    writer = PredictionWriter(str(folder / f"labels{processes}"))
    make_trainer(folder, processes, writer).predict(model, data, return_predictions=False)
    report = json.loads((folder / f"log{processes}/test.json").read_text())
    return {"validated": validated, "tested": tested, "report": report}


if __name__ == "__main__":
    torch.set_num_threads(1)
    here = Path(sys.argv[1])
    for network in NETWORKS:
        monitor = fit(here, here / network)
        found = {"monitor": monitor, "scores": measure(here, here / network, 2)}
        (here / network / "found.json").write_text(json.dumps(found))
