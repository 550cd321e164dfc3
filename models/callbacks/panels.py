"""Pictures of a few validation scans in TensorBoard, the same ones throughout a training."""

from typing import Any

import lightning
from lightning.pytorch.loggers import TensorBoardLogger

from derain.learning.batch import Batch
from derain.models.base import DerainingModule
from derain.models.callbacks.drawn_epochs import DrawnEpochs
from derain.pictures.scan_pictures import judgement_figure


class ScanPanels(lightning.Callback):
    """Logs input, truth, prediction and error of the first rainy validation scans.

    Of several processes the first draws, of the scans that it measures.

    A picture costs as much as a step of training and more, and of each scan TensorBoard shows ten
    pictures. So ten of the epochs are drawn, chosen as :class:`DrawnEpochs` says.

    Args:
        scans: How many scans to show; 0 shows none.
        pictures: How many pictures of each to draw in a training.
    """

    def __init__(self, scans: int = 2, pictures: int = 10) -> None:
        self.scans = scans
        self.epochs = DrawnEpochs(pictures)
        self.left = 0

    def on_validation_epoch_start(self, trainer: lightning.Trainer, *_: Any) -> None:
        """Starts counting anew; the order of validation scans is fixed."""
        draws = self.epochs.begins(trainer) and trainer.is_global_zero
        self.left = self.scans if draws else 0

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
        for measured, probability in zip(batch.measured, outputs, strict=True):
            scan = measured.scan
            if not self.left or scan.label is None:
                continue
            rain = model.card.rain_of(scan)
            if not rain.any():
                continue
            figure = judgement_figure(scan, probability > model.spec.threshold, rain, scan.name)
            name = f"validation scan {self.scans - self.left}"
            trainer.logger.experiment.add_figure(name, figure, trainer.global_step)
            self.left -= 1
