"""Writes what ``derain predict`` finds, one label file per scan."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import lightning
import torch
from lightning.pytorch.callbacks import BasePredictionWriter

from derain.errors import counted, printable
from derain.learning.batch import Batch
from derain.learning.task import ReadableScans
from derain.models.base import DerainingModule
from derain.scan import Float32s
from derain.sources.frame import MemoryFrame
from derain.sources.sink import FolderSink


class PredictionWriter(BasePredictionWriter):
    """Writes ``.label`` files (1 for rain, one per row of the scan) into a folder.

    Args:
        folder: Folder to write to; the scans' own folders are repeated below it.
    """

    def __init__(self, folder: str = "predictions") -> None:
        super().__init__(write_interval="batch")
        self.sink = FolderSink(Path(folder), "--predictions.folder")
        self.written = 0

    def on_predict_start(self, trainer: lightning.Trainer, model: DerainingModule) -> None:
        """Looks at where the labels of all scans will be, before the first of them is judged.

        Raises:
            InputError: What is to be written would lie where a scan or its labels are looked for,
                or take the place of what is written for another scan.
        """
        # What is written need not be kept: probabilities of a data set fill gigabytes.
        trainer.predict_loop.return_predictions = False
        self.written = 0
        dataset = getattr(trainer.predict_dataloaders, "dataset", None)
        if isinstance(dataset, ReadableScans):
            # Two patterns may find one scan.
            frames = {(frame.name, frame.key): frame for frame in dataset.frames}
            self.sink.refuse_clashes(frames.values())

    def write_on_batch_end(
        self,
        trainer: lightning.Trainer,
        model: DerainingModule,
        prediction: Sequence[Float32s],
        batch_indices: Sequence[int] | None,
        batch: Batch,
        *_: Any,
    ) -> None:
        """Writes the labels of one batch.

        Raises:
            InputError: A folder that cannot be written.
        """
        for measured, probability in zip(batch.measured, prediction, strict=True):
            frame = MemoryFrame(key=measured.key, scan=measured.scan)
            self.sink.write(frame, None, probability > model.spec.threshold)
            self.written += 1

    def on_predict_end(self, trainer: lightning.Trainer, model: DerainingModule) -> None:
        """Prints how many files all processes have written."""
        of_this = torch.tensor(self.written, device=model.device)
        written = int(trainer.strategy.reduce(of_this, reduce_op="sum"))
        if trainer.is_global_zero:
            files = counted(written, "label file")
            print(printable(f"Wrote {files} to {self.sink.folder}"))
