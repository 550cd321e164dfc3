"""Where a derainer errs, in TensorBoard: by class, by range, and at which threshold."""

from typing import Any

import lightning
import numpy as np
from lightning.pytorch.loggers import TensorBoardLogger
from numpy.typing import NDArray

from derain.evaluation.counts import RainCounts, band_names
from derain.evaluation.operating_points import CURVE_THRESHOLDS, OperatingPoints
from derain.models.base import DerainingModule
from derain.models.callbacks.drawn_epochs import DrawnEpochs
from derain.pictures.error_pictures import errors_figure, operating_points_figure

# Groups of scalars.
BY_CLASS, LEFT_BY_RANGE, LOST_BY_RANGE = "errors_by_class", "rain_left_by_range", "lost_by_range"


class ErrorPanels(lightning.Callback):
    """Logs what is judged wrongly, of every validation as numbers, of some epochs as pictures.

    As numbers: the share of each class that is judged wrongly, and by range the share of the rain
    that is left and of all else that is lost. As pictures, and of the test: a table by class and
    range, and the precision-recall curve with the chosen threshold, which TensorBoard's own panel
    of such curves gets, too.

    Args:
        pictures: Of how many epochs to draw pictures in a training, chosen as
            :class:`DrawnEpochs` says, besides the last validation; 0 draws none.
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
        points = model.threshold_counts.points()
        table = model.metrics.counts().by_class_and_range()
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
    classes = measured.by_class().items()
    bands = measured.by_range().items()
    return (
        {f"{BY_CLASS}/{name}": counts.share_wrong for name, counts in classes if counts.points}
        | {
            f"{LEFT_BY_RANGE}/{band}": 1 - counts.recall
            for band, counts in bands
            if counts.true_positive + counts.false_negative
        }
        | {
            f"{LOST_BY_RANGE}/{band}": counts.false_positive / others
            for band, counts in bands
            if (others := counts.false_positive + counts.true_negative)
        }
    )


def _of_curve(points: OperatingPoints) -> tuple[NDArray[np.float64] | NDArray[np.int64], ...]:
    """What TensorBoard wants of a curve, at thresholds from 0 to 1 in equal steps."""
    even = points.among(CURVE_THRESHOLDS)
    hits, false = even.true_positive, even.false_positive
    negatives, misses = points.other - false, points.rain - hits
    return hits, false, negatives, misses, even.precision, even.recall
