"""Writes what ``derain predict`` finds, one label file per scan."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import lightning
import numpy as np
from lightning.pytorch.callbacks import BasePredictionWriter
from numpy.typing import NDArray

from derain.batch import Batch
from derain.files.labels import write_labels
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

    def on_predict_start(self, trainer: lightning.Trainer, model: DerainingModule) -> None:
        """Finds the folder that all scans lie below."""
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
        for sample, probability in zip(batch.samples, prediction, strict=True):
            path = self.folder / os.path.relpath(sample.scan.name, self.root)
            write_labels(path.with_suffix(".label"), probability > model.spec.threshold)
