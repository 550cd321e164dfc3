"""Writes what ``derain predict`` finds, one label file per scan."""

import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import lightning
import numpy as np
import torch
from lightning.pytorch.callbacks import BasePredictionWriter
from numpy.typing import NDArray

from derain.errors import InputError, printable
from derain.files.labels import LABEL, write_labels
from derain.files.names import beside
from derain.learning.batch import Batch
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
        """Finds the folder that all scans lie below, before the first of them is judged.

        Raises:
            InputError: What is to be written would take the place of labels that are there, or
                of what is written for another scan.
        """
        # What is written need not be kept: probabilities of a data set fill gigabytes.
        trainer.predict_loop.return_predictions = False
        self.written = 0
        # Not its files(), which have no labels in prediction: here they count, though none is read.
        files = trainer.datamodule.find("predict")  # type: ignore[attr-defined]
        scans = [file.scan for file in files]
        self.root = os.path.commonpath([scan.parent for scan in scans])
        self._refuse_labels(scans, [file.label for file in files])
        self._refuse_clashes(scans)
        # What one process writes must not be there while another looks for labels.
        trainer.strategy.barrier()

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
            path = self._target(Path(measured.scan.name))
            write_labels(path, probability > model.spec.threshold)
            self.written += 1

    def on_predict_end(self, trainer: lightning.Trainer, model: DerainingModule) -> None:
        """Says what was written, by all processes together."""
        of_this = torch.tensor(self.written, device=model.device)
        written = int(trainer.strategy.reduce(of_this, reduce_op="sum"))
        if trainer.is_global_zero:
            files = "1 label file" if written == 1 else f"{written:,} label files"
            print(printable(f"Wrote {files} to {self.folder}"))

    def _target(self, scan: Path) -> Path:
        """Where the labels that are found for a scan are written."""
        return beside(self.folder / os.path.relpath(scan, self.root), LABEL)

    def _refuse_labels(self, scans: Sequence[Path], labels: Iterable[Path | None]) -> None:
        """Refuses to overwrite what labels there are, where the data have them or beside a scan."""
        known = [*filter(None, labels), *(beside(scan, LABEL) for scan in scans)]
        # Not Path.is_file, which raises where the name has become too long by its suffix.
        there = {os.path.realpath(label) for label in known if os.path.isfile(label)}
        for scan in scans:
            if os.path.realpath(target := self._target(scan)) in there:
                raise InputError(
                    self.folder,
                    f"what is found for {scan} would overwrite the labels {target}",
                    "Give --predictions.folder another folder.",
                )

    def _refuse_clashes(self, scans: Sequence[Path]) -> None:
        """Refuses scans whose labels would have one name, such as 0.bin and 0.pcd."""
        scan_of: dict[str, Path] = {}
        for scan in scans:
            target = self._target(scan)
            other = scan_of.setdefault(os.path.realpath(target), scan)
            if other != scan:  # patterns may well find a scan twice
                raise InputError(
                    self.folder,
                    f"what is found for {other} and for {scan} would both be {target}",
                    "Take them in two runs, and give --predictions.folder another folder in each.",
                )
