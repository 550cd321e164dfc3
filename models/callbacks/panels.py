"""TensorBoard's view of a training: pictures of scans and of errors, and a page of charts."""

from typing import Any

import lightning
import numpy as np
from lightning.pytorch.loggers import TensorBoardLogger
from lightning.pytorch.trainer.states import TrainerFn

from derain.evaluation.counts import RainCounts, band_names
from derain.evaluation.operating_points import CURVE_THRESHOLDS, OperatingPoints
from derain.learning.batch import Batch
from derain.models.base import DerainingModule
from derain.models.callbacks.step_times import SPEED, STEP
from derain.pictures.error_pictures import errors_figure, operating_points_figure
from derain.pictures.scan_pictures import comparison_figure
from derain.scan import Floats, Ints

# Groups of scalars.
BY_CLASS, LEFT_BY_RANGE, LOST_BY_RANGE = "errors_by_class", "rain_left_by_range", "lost_by_range"

# Charts by question, each with regular expressions of the scalars in it. All lines of a run have
# one colour, and only their marks tell them apart: what is to be compared stands in one chart.
CHARTS = {
    "Is it learning?": {
        "loss in training": ["train/loss$"],
        "loss in validation": ["val/loss$"],
        "parts of the loss in training": ["train/(?!loss$)"],
        "validation: IoU": ["val/iou$"],
        "validation: precision": ["val/precision$"],
        "validation: recall": ["val/recall$"],
        "validation: average precision": ["val/average_precision$"],
    },
    "Where does it err?": {
        "share of each class that is judged wrongly": [f"{BY_CLASS}/"],
        "share of the rain that is left, by range": [f"{LEFT_BY_RANGE}/"],
        "share of all else that is lost, by range": [f"{LOST_BY_RANGE}/"],
    },
    "How fast is it?": {
        "milliseconds of a step": [f"{STEP}/"],
        "scans per second": [f"{SPEED}/"],
    },
}


class DrawnEpochs:
    """Chooses some of the epochs that end in a validation, spread from the first to the last.

    Where the number of epochs is not known, each chosen one comes after twice as many
    validations as the one before it. Of an epoch with several validations, the first is drawn.

    Args:
        pictures: Number of epochs that are drawn in a training whose length is known.
    """

    def __init__(self, pictures: int) -> None:
        self.pictures = pictures
        self.last: int | None = None

    def begins(self, trainer: lightning.Trainer) -> bool:
        """True if what is measured now is drawn; called once, when a validation or test begins."""
        if trainer.sanity_checking or not self.pictures:
            return False
        if trainer.state.fn != TrainerFn.FITTING:
            return True
        if trainer.current_epoch == self.last or not self._chosen(trainer):
            return False
        self.last = trainer.current_epoch
        return True

    def _chosen(self, trainer: lightning.Trainer) -> bool:
        epochs = trainer.max_epochs
        every = trainer.check_val_every_n_epoch or 1
        validation = (trainer.current_epoch + 1) // every
        if epochs is None or epochs < 1:
            return validation & (validation - 1) == 0  # a power of two
        return validation - 1 in np.linspace(0, epochs // every - 1, self.pictures).round()


class ScanPanels(lightning.Callback):
    """Logs input, truth and prediction of the first rainy validation scans.

    Of several processes the first draws, of the scans that it measures.

    A picture costs as much as a step of training and more, and of each scan TensorBoard shows ten
    pictures. So ten of the epochs are drawn, chosen by :class:`DrawnEpochs`.

    Args:
        scans: Number of scans to show; 0 shows none.
        pictures: Number of pictures of each to draw in a training.
    """

    def __init__(self, scans: int = 2, pictures: int = 10) -> None:
        self.scans = scans
        self.epochs = DrawnEpochs(pictures)
        self.left = 0

    def on_validation_epoch_start(self, trainer: lightning.Trainer, *_: Any) -> None:
        """Restarts counting; the order of validation scans is fixed."""
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
            called = {"prediction": probability > model.spec.threshold}
            figure = comparison_figure(scan, called, rain, scan.name)
            name = f"validation scan {self.scans - self.left}"
            trainer.logger.experiment.add_figure(name, figure, trainer.global_step)
            self.left -= 1


class ErrorPanels(lightning.Callback):
    """Logs what is judged wrongly, of every validation as numbers, of some epochs as pictures.

    As numbers: the share of each class that is judged wrongly, and by range the share of the rain
    that is left and of all else that is lost. As pictures, and of the test: a table by class and
    range, and the precision-recall curve with the chosen threshold, which TensorBoard's own panel
    of such curves gets, too.

    Args:
        pictures: Of how many epochs to draw pictures in a training, chosen by
            :class:`DrawnEpochs`, besides the last validation; 0 draws none.
    """

    def __init__(self, pictures: int = 10) -> None:
        self.epochs = DrawnEpochs(pictures)
        self.draws = False
        self.undrawn: int | None = None  # step of the last validation, where it was not drawn

    def on_validation_epoch_start(self, trainer: lightning.Trainer, *_: Any) -> None:
        """Chooses whether this validation is drawn."""
        self.draws = self.epochs.begins(trainer)

    def on_validation_epoch_end(self, trainer: lightning.Trainer, model: DerainingModule) -> None:
        """Logs the errors of a validation."""
        if trainer.sanity_checking or not model.metrics.counts().per_scan:
            return
        values = errors_by_name(model.metrics.counts())  # of all processes
        for logger in trainer.loggers:
            logger.log_metrics(values, trainer.global_step)
        if self.draws:
            self._draw(trainer, model, "validation", trainer.global_step)
        self.undrawn = None if self.draws else trainer.global_step

    def on_train_end(self, trainer: lightning.Trainer, model: DerainingModule) -> None:
        """Draws the last validation, whenever that was; its counts are still there."""
        if self.undrawn is not None and self.epochs.pictures:
            self._draw(trainer, model, "validation", self.undrawn)
        self.undrawn = None

    def on_test_epoch_end(self, trainer: lightning.Trainer, model: DerainingModule) -> None:
        """Draws the errors of a test."""
        if self.epochs.pictures and model.metrics.counts().per_scan:
            self._draw(trainer, model, "test", model.trained_steps or trainer.global_step)

    def _draw(
        self, trainer: lightning.Trainer, model: DerainingModule, part: str, step: int
    ) -> None:
        # All processes put the counts together, the first one draws.
        points, measured = model.threshold_counts.points(), model.metrics.counts()
        if not any(counts.points for counts in measured.by_class.values()):
            return  # as of scans that hold no point, or none whose class is known
        table = measured.by_class_and_range()
        title = f"{part} on {model.card.name}, step {step:,}"
        for logger in trainer.loggers:
            if not isinstance(logger, TensorBoardLogger) or not trainer.is_global_zero:
                continue
            writer = logger.experiment
            figure = errors_figure(table, band_names(), title)
            writer.add_figure(f"{part}: errors by class and range", figure, step)
            if points.rain:
                figure = operating_points_figure(points, model.spec.threshold, title)
                writer.add_figure(f"{part}: threshold", figure, step)
                writer.add_pr_curve_raw(
                    f"{part}: rain", *_of_curve(points), step, len(CURVE_THRESHOLDS)
                )


def errors_by_name(measured: RainCounts) -> dict[str, float]:
    """Shares that are judged wrongly, by the names of their scalars; where there are points."""
    classes = measured.by_class.items()
    shares = {f"{BY_CLASS}/{name}": each.share_wrong for name, each in classes if each.points}
    bands = measured.by_range
    for band, counts in bands.items():
        if counts.true_positive + counts.false_negative:
            shares[f"{LEFT_BY_RANGE}/{band}"] = 1 - counts.recall
    for band, counts in bands.items():
        if others := counts.false_positive + counts.true_negative:
            shares[f"{LOST_BY_RANGE}/{band}"] = counts.false_positive / others
    return shares


def _of_curve(points: OperatingPoints) -> tuple[Floats | Ints, ...]:
    """A curve in TensorBoard's form, at thresholds from 0 to 1 in equal steps."""
    even = np.searchsorted(points.thresholds, CURVE_THRESHOLDS)
    hits, false = points.true_positive[even], points.false_positive[even]
    negatives, misses = points.other - false, points.rain - hits
    return hits, false, negatives, misses, points.precision[even], points.recall[even]


class Dashboard(lightning.Callback):
    """Lays out the page at the start of a training."""

    def on_train_start(self, trainer: lightning.Trainer, *_: Any) -> None:
        """Writes the layout, which TensorBoard keeps with the run."""
        for logger in trainer.loggers:
            if isinstance(logger, TensorBoardLogger):
                logger.experiment.add_custom_scalars(
                    {
                        question: {title: ["Multiline", tags] for title, tags in charts.items()}
                        for question, charts in CHARTS.items()
                    }
                )
