"""Measurement and logging of derainers: in validation, test and prediction."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import astuple
from typing import Any, ClassVar

import lightning
import torch
from lightning.pytorch.loggers import TensorBoardLogger
from torch import Tensor
from torch.utils.tensorboard.summary import hparams

from derain.cards.card import DataCard
from derain.cards.rain_found import warn_without_rain
from derain.evaluation.counts import SCORES, Counts
from derain.evaluation.metrics import RainMetrics
from derain.evaluation.operating_points import ThresholdCounts
from derain.learning.batch import Batch
from derain.learning.mean_losses import MeanLosses
from derain.learning.task import ReadableScans
from derain.scan import Float32s, Scan
from derain.spec import Spec
from derain.views.probability import probability_of_rain

# The monitor, by which the best checkpoint of a run is chosen, the more the better: the IoU of the
# validation scans where a network learns from labels and there is rain in them, else minus the
# loss. Logs, checkpoints and configurations have it under this name.
MONITOR = "val/score"

# By what the table ranks runs: the IoU of the latest validation, and the scores of the test.
COLUMNS = ("hp_metric", *(f"test/{score}" for score in reversed(SCORES)), "test/average_precision")


class MeasuredModule(lightning.LightningModule, ABC):
    """Measures a network: every scan once, on any number of processes, counts in whole numbers.

    Attributes:
        LEARNS_FROM_LABELS: True if it does; where not, none is read in its training.
        card: Data card of what is measured, once that is agreed with the data.
        metrics: Counts of the points of the epoch, made when the data are known.
        threshold_counts: Their probabilities, counted between thresholds.
        mean_losses: Sums of the epoch's losses.
    """

    LEARNS_FROM_LABELS: ClassVar[bool] = True
    card: DataCard
    metrics: RainMetrics
    threshold_counts: ThresholdCounts

    def __init__(self) -> None:
        super().__init__()
        self.mean_losses = MeanLosses()
        # Of the checkpoint that is tested: where its scores stand in the log of its training.
        self.trained_steps: int | None = None
        self.warned_of_no_rain = False

    @property
    @abstractmethod
    def spec(self) -> Spec:
        """The Spec: how the network is used."""

    def validation_scans(self, most: int) -> Iterator[Scan]:
        """Reads some of the validation scans, spread over all of them, as they are in their files.

        Args:
            most: The largest number; none where their loader is not derain's.

        Raises:
            InputError: A scan that cannot be read.
        """
        dataset = getattr(self.trainer.val_dataloaders, "dataset", None)
        return dataset.scans(most) if isinstance(dataset, ReadableScans) else iter(())

    @abstractmethod
    def forward(self, *_: Tensor, **inputs: Tensor) -> Tensor:
        """Logits of "not rain" and "rain" of every cell, float (M, 2), of a view's raw inputs.

        Args:
            inputs: Inputs from the view, by name.
        """

    def logits_of(self, batch: Batch) -> Tensor:
        """Logits of "not rain" and "rain" of every cell of a batch, float (M, 2).

        By default of all its scans at once. A network in which the points of one scan would tell
        those of another something takes them one by one.
        """
        return self(**batch.inputs)

    @abstractmethod
    def losses(self, batch: Batch) -> tuple[dict[str, Tensor], Tensor]:
        """The losses that training lowers, and the logits.

        Returns:
            ``loss`` and what it is made of, each a scalar, by name; and the logits of "not rain"
            and "rain" of every cell, float (M, 2).
        """

    def validation_step(self, batch: Batch) -> list[Float32s]:
        """Loss of one batch, its points counted, and the probability of each, as for predict."""
        losses, logits = self.losses(batch)
        self.mean_losses.update(losses, scans=len(batch.measured))
        return self._count(batch, logits)

    def test_step(self, batch: Batch) -> None:
        """Counts the points of one batch."""
        self._count(batch, self.logits_of(batch))

    def predict_step(self, batch: Batch) -> list[Float32s]:
        """Probability of rain for every row of every scan, a list of float32 (N,)."""
        return self.probabilities(batch, self.logits_of(batch))

    def on_validation_epoch_start(self) -> None:
        """Forgets losses and scores of the last epoch, or of the sanity check."""
        self.mean_losses.reset()
        self.metrics.reset()
        self.threshold_counts.reset()

    def on_validation_epoch_end(self) -> None:
        """Logs losses and scores of the epoch."""
        losses = self.mean_losses.compute()
        self._log_identical({f"val/{name}": loss for name, loss in losses.items()})
        self._log_scores("val")
        self._log_identical({MONITOR: self._score(losses["loss"])})

    def on_test_epoch_start(self) -> None:
        """Forgets the scores of another test."""
        self.metrics.reset()
        self.threshold_counts.reset()

    def on_test_epoch_end(self) -> None:
        """Logs the scores of the test; the metrics keep their counts for whoever reports them."""
        if self.trained_steps is not None and not self.trainer.global_step:
            self._log_identical({"step": torch.tensor(float(self.trained_steps))})
        self._log_scores("test")

    def probabilities(self, batch: Batch, logits: Tensor) -> list[Float32s]:
        """Carries logits back to every row of every scan, as the deployed model does.

        Args:
            batch: A batch.
            logits: Of "not rain" and "rain" of every cell, float (M, 2).

        Returns:
            The probability of rain, a float32 (N,) for each scan that is measured.
        """
        if not batch.measured:
            return []
        return [
            scan.back_projection(probability_of_rain(scores.float().cpu().numpy()))
            for scan, scores in zip(batch.measured, batch.split(logits), strict=True)
        ]

    def _count(self, batch: Batch, logits: Tensor) -> list[Float32s]:
        probabilities = self.probabilities(batch, logits)
        for measured, probability in zip(batch.measured, probabilities, strict=True):
            scan = measured.scan
            if scan.label is not None:
                self.metrics.update(scan, probability > self.spec.threshold)
                known = ~self.card.unknown_of(scan)
                rain = self.card.rain_of(scan)
                self.threshold_counts.update(probability[known], rain[known])
        return probabilities

    def _log_scores(self, part: str) -> None:
        counts = self.metrics.counts()
        if not counts.per_scan:  # scans without labels measure nothing
            return
        self._warn_without_rain(counts.pooled)
        scores = self.metrics.compute() | self.threshold_counts.compute()
        self._log_identical({f"{part}/{name}": score for name, score in scores.items()})
        self._log_identical({f"{part}_iou": scores["iou"]}, prog_bar=True, logger=False)
        for name, ids in self.card.parts.items():
            self._log_of_one(f"{part}/{name}", counts.pooled_over(ids))
        if part == "val":
            self._log_identical({"hp_metric": scores["iou"]})

    def _score(self, loss: Tensor) -> Tensor:
        """The score that chooses the best checkpoint, given the loss of the validation scans."""
        if not self.LEARNS_FROM_LABELS:
            return -loss
        counts = self.metrics.counts().pooled
        if counts.true_positive + counts.false_negative:
            return torch.tensor(counts.iou, dtype=torch.float32, device=loss.device)
        # Without rain the IoU is undefined, or 0 because of a single point.
        return -loss

    def _warn_without_rain(self, counts: Counts) -> None:
        """Warns once where the measured scans have no rain."""
        found = bool(counts.true_positive + counts.false_negative)
        trainer = self.trainer
        if not (found or trainer.sanity_checking or self.warned_of_no_rain):
            self.warned_of_no_rain = True
            if trainer.is_global_zero:
                warn_without_rain(found, self.card)

    def _log_of_one(self, title: str, counts: Counts) -> None:
        """Logs the scores of one of several data sets, where any scan of it was measured."""
        if sum(astuple(counts)):
            scores = {f"{title}/{score}": getattr(counts, score) for score in SCORES}
            self._log_identical({name: torch.tensor(score) for name, score in scores.items()})

    def _log_identical(self, values: Mapping[str, Tensor], **options: Any) -> None:
        """Logs what all processes have computed alike; the largest of equal numbers is exact."""
        self.log_dict(values, sync_dist=True, reduce_fx="max", **options)


def log_hyperparameters(loggers: Iterable[object], parameters: Mapping[str, Any]) -> None:
    """Enters a run. What is not logged yet stays blank in the table, a test above all.

    Args:
        loggers: The run's; those of TensorBoard are written to.
        parameters: Entries of the table. The Spec, which is as long as a page, and names
            that begin with an underscore are left out.
    """
    shown = {
        name: value if isinstance(value, bool | int | float | str) else _as_text(value)
        for name, value in parameters.items()
        if name != "spec" and not name.startswith("_")
    }
    for logger in loggers:
        # TensorBoard takes the columns of all runs from one of them, so that each must name those
        # of the test, too. Lightning would log a score of 0 for each column, which nobody measured.
        writer: Any = logger.experiment.file_writer if isinstance(logger, TensorBoardLogger) else 0
        if hasattr(writer, "add_summary"):  # as of the first process
            for summary in hparams(shown, dict.fromkeys(COLUMNS, 0.0)):
                writer.add_summary(summary)


def _as_text(value: Any) -> str:
    if isinstance(value, tuple | list):
        return ", ".join(map(str, value))
    return str(value)
