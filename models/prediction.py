"""Writes what ``derain predict`` finds, one label file per scan."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import lightning
import numpy as np
import torch
from lightning.pytorch.callbacks import BasePredictionWriter
from numpy.typing import NDArray

from derain.batch import Batch
from derain.files.labels import LABEL, write_labels
from derain.files.names import beside
from derain.models.base import DerainingModule


class PredictionWriter(BasePredictionWriter):
    """Writes ``.label`` files (1 for rain, one per row of the scan) into a folder.

    Args:
        folder: Where to write; the scans' own folders are repeated below it.
    """

    def __init__(self, folder: str = "predictions") -> None:
        super().__init__(write_interval="batch")
        self.folder = Path(folder)
        self.root = "."
        self.written = 0

    def on_predict_start(self, trainer: lightning.Trainer, model: DerainingModule) -> None:
        """Finds the folder that all scans lie below."""
        # What is written need not be kept: probabilities of a data set fill gigabytes.
        trainer.predict_loop.return_predictions = False
        self.written = 0
        files = trainer.datamodule.files("predict")  # type: ignore[attr-defined]
        self.root = os.path.commonpath([file.scan.parent for file in files])

    def write_on_batch_end(
        self,
        trainer: lightning.Trainer,
        model: DerainingModule,
        prediction: Sequence[NDArray[np.float32]],
        batch_indices: Sequence[int] | None,
        batch: Batch,
        *_: Any,
    ) -> None:
        """Writes the labels of one batch.

        Raises:
            InputError: A folder that cannot be written.
        """
        for measured, probability in zip(batch.measured, prediction, strict=True):
            path = self.folder / os.path.relpath(measured.scan.name, self.root)
            write_labels(beside(path, LABEL), probability > model.spec.threshold)
            self.written += 1

    def on_predict_end(self, trainer: lightning.Trainer, model: DerainingModule) -> None:
        """Says what was written, by all processes together."""
        of_this = torch.tensor(self.written, device=model.device)
        written = int(trainer.strategy.reduce(of_this, reduce_op="sum"))
        if trainer.is_global_zero:
            files = "1 label file" if written == 1 else f"{written:,} label files"
            print(f"Wrote {files} to {self.folder}")
