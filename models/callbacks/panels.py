"""TensorBoard's view of a training: pictures of scans and of errors, and a page of charts."""

from typing import Any

import lightning
import numpy as np
from lightning.pytorch.loggers import TensorBoardLogger

from derain.evaluation.counts import RainCounts, band_names
from derain.evaluation.operating_points import CURVE_THRESHOLDS, OperatingPoints
from derain.learning.batch import Batch
from derain.models.base import DerainingModule
from derain.models.callbacks.step_times import SPEED, STEP
from derain.pictures.error_pictures import errors_figure, operating_points_figure
from derain.pictures.scan_pictures import comparison_figure
from derain.scan import Bools, Floats, Ints, Scan

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


class Panels(lightning.Callback):
    """Logs what is judged wrongly, of every validation as numbers, of some as pictures.

    The numbers have charts on a page that is laid out by the questions of ``CHARTS``.

    As numbers: the share of each class that is judged wrongly, and by range the share of the rain
    that is left and of all else that is lost. As pictures: input, truth and prediction of the first
    rainy validation scans; and, also of the test, a table by class and range, and the
    precision-recall curve with the chosen threshold, which TensorBoard's own panel of such curves
    gets, too.

    A picture costs as much as a step of training and more. So validations 1, 2, 4, 8 and so on are
    drawn, and the last one. Of several processes the first draws, of the scans that it measures.

    Args:
        scans: Number of scans to show; 0 draws no picture at all.
    """

    def __init__(self, scans: int = 2) -> None:
        self.scans = scans
        self.validations = 0
        # The scans to show, what is called rain in each, and its rain.
        self.shown: list[tuple[Scan, Bools, Bools]] = []
        self.undrawn: int | None = None  # step of the last validation, where it was not drawn

    def on_train_start(self, trainer: lightning.Trainer, *_: Any) -> None:
        """Writes the layout of the page, which TensorBoard keeps with the run."""
        layout = {
            question: {title: ["Multiline", tags] for title, tags in charts.items()}
            for question, charts in CHARTS.items()
        }
        for writer in _writers(trainer):
            writer.add_custom_scalars(layout)

    def on_validation_epoch_start(self, trainer: lightning.Trainer, *_: Any) -> None:
        """Begins with the first scan again; the order of validation scans is fixed."""
        self.shown = []
        if not trainer.sanity_checking:
            self.validations += 1

    def on_validation_batch_end(
        self,
        trainer: lightning.Trainer,
        model: DerainingModule,
        outputs: Any,
        batch: Batch,
        *_: Any,
    ) -> None:
        """Keeps the first rainy scans, to be drawn."""
        for measured, probability in zip(batch.measured, outputs, strict=True):
            if len(self.shown) == self.scans:
                return
            scan = measured.scan
            if scan.label is None:
                continue
            rain = model.card.rain_of(scan)
            if rain.any():
                self.shown.append((scan, probability > model.spec.threshold, rain))

    def on_validation_epoch_end(self, trainer: lightning.Trainer, model: DerainingModule) -> None:
        """Logs the errors of a validation, and draws it if its number is a power of two."""
        if trainer.sanity_checking or not model.metrics.counts().per_scan:
            return
        values = errors_by_name(model.metrics.counts())  # of all processes
        for logger in trainer.loggers:
            logger.log_metrics(values, trainer.global_step)
        self.undrawn = trainer.global_step
        if self.validations & (self.validations - 1) == 0:
            self._draw_validation(trainer, model)

    def on_train_end(self, trainer: lightning.Trainer, model: DerainingModule) -> None:
        """Draws the last validation, whenever that was; its counts are still there."""
        self._draw_validation(trainer, model)

    def on_test_epoch_end(self, trainer: lightning.Trainer, model: DerainingModule) -> None:
        """Draws the errors of a test."""
        if self.scans and model.metrics.counts().per_scan:
            _draw_errors(trainer, model, "test", model.trained_steps or trainer.global_step)

    def _draw_validation(self, trainer: lightning.Trainer, model: DerainingModule) -> None:
        """Draws the last validation, unless it is drawn already."""
        if not self.scans or self.undrawn is None:
            return
        _draw_errors(trainer, model, "validation", self.undrawn)
        for writer in _writers(trainer):
            for number, (scan, called_rain, rain) in enumerate(self.shown):
                called = {"prediction": called_rain}
                figure = comparison_figure(scan, called, rain, scan.name)
                writer.add_figure(f"validation scan {number}", figure, self.undrawn)
        self.undrawn = None


def _draw_errors(trainer: lightning.Trainer, model: DerainingModule, part: str, step: int) -> None:
    # All processes put the counts together, the first one draws.
    points, measured = model.threshold_counts.points(), model.metrics.counts()
    if not any(counts.points for counts in measured.by_class.values()):
        return  # as of scans that hold no point, or none whose class is known
    table = measured.by_class_and_range()
    title = f"{part} on {model.card.name}, step {step:,}"
    for writer in _writers(trainer):
        figure = errors_figure(table, band_names(), title)
        writer.add_figure(f"{part}: errors by class and range", figure, step)
        if points.rain:
            figure = operating_points_figure(points, model.spec.threshold, title)
            writer.add_figure(f"{part}: threshold", figure, step)
            curve = _of_curve(points)
            writer.add_pr_curve_raw(f"{part}: rain", *curve, step, len(CURVE_THRESHOLDS))


def _writers(trainer: lightning.Trainer) -> list[Any]:
    """TensorBoard's writers of the process that draws; in the others none."""
    loggers = trainer.loggers if trainer.is_global_zero else []
    return [logger.experiment for logger in loggers if isinstance(logger, TensorBoardLogger)]


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
