"""Pictures of a few validation scans in TensorBoard, the same ones after every epoch."""

from typing import Any

import lightning
from lightning.pytorch.loggers import TensorBoardLogger

from derain.batch import Batch
from derain.models.base import DerainingModule
from derain.pictures import judgement_figure


class ScanPanels(lightning.Callback):
    """Logs input, truth, prediction and error of the first rainy validation scans.

    Args:
        scans: How many scans to show; 0 shows none.
    """

    def __init__(self, scans: int = 2) -> None:
        self.scans = scans
        self.left = 0

    def on_validation_epoch_start(self, trainer: lightning.Trainer, *_: Any) -> None:
        """Starts counting anew; the order of validation scans is fixed."""
        self.left = 0 if trainer.sanity_checking else self.scans

    def on_validation_batch_end(
        self,
        trainer: lightning.Trainer,
        model: DerainingModule,
        outputs: Any,
        batch: Batch,
        *_: Any,
    ) -> None:
        """Draws the batch's rainy scans while there are panels left to fill."""
        if not self.left or not isinstance(trainer.logger, TensorBoardLogger):
            return
        for sample, probability in zip(batch.samples, outputs, strict=True):
            if not self.left or sample.scan.label is None:
                continue
            rain = model.card.rain_of(sample.scan)
            if not rain.any():
                continue
            figure = judgement_figure(
                sample.scan, probability > model.spec.threshold, rain, sample.scan.name
            )
            name = f"validation scan {self.scans - self.left}"
            trainer.logger.experiment.add_figure(name, figure, trainer.global_step)
            self.left -= 1
