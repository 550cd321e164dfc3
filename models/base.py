"""What every derainer shares: its Spec, its metrics, and what it logs."""

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, Protocol, Self

import lightning
import numpy as np
import torch
from lightning.pytorch.loggers import TensorBoardLogger
from numpy.typing import NDArray
from torch import Tensor, nn

from derain.batch import Batch
from derain.cards import DataCard
from derain.errors import InputError
from derain.losses import class_weights, segmentation_loss
from derain.metrics import RainMetrics
from derain.probability import probability_of_rain
from derain.spec import Spec


class HasCard(Protocol):
    """What a derainer asks of the data module it is trained or tested with."""

    card: DataCard


class DerainingModule(lightning.LightningModule):
    """A network with its loss, metrics and Spec.

    The Spec comes from the first data the model is trained on and from then on travels in its
    checkpoints; so the input's normalisation is never configured twice.

    Attributes:
        NAME: Name of the network in a Spec and on the command line.
        network: The network itself.
        card: Data card of the data it is trained or tested on.
    """

    NAME: ClassVar[str]
    network: nn.Module
    mean: Tensor
    std: Tensor
    class_weight: Tensor
    metrics: RainMetrics
    card: DataCard

    def __init__(self) -> None:
        super().__init__()
        self._spec: Spec | None = None
        # Not in the state_dict: the Spec holds them.
        self.register_buffer("mean", torch.zeros(4), persistent=False)
        self.register_buffer("std", torch.ones(4), persistent=False)
        self.register_buffer("class_weight", torch.ones(2), persistent=False)

    @property
    def spec(self) -> Spec:
        """How the network is used.

        Raises:
            InputError: Neither data nor a checkpoint has said so yet.
        """
        if self._spec is None:
            raise InputError(self.NAME, "has not been trained", "Give a checkpoint: --ckpt_path.")
        return self._spec

    @abstractmethod
    def view_parameters(self) -> dict[str, Any]:
        """Kind and parameters of the view that the network sees."""

    @abstractmethod
    def folded(self) -> nn.Module:
        """The network as it is deployed: raw inputs to logits, BatchNorm folded in."""

    @classmethod
    @abstractmethod
    def from_published(cls, state_dict: Mapping[str, Tensor], card: DataCard) -> Self:
        """Builds the model from published weights.

        Args:
            state_dict: Published tensors.
            card: Data card whose statistics they were trained with.

        Raises:
            InputError: Weights of another network.
        """

    def adopt(self, spec: Spec | dict[str, Any] | None) -> None:
        """Takes over a Spec, its normalisation included.

        Raises:
            InputError: A Spec that this derain cannot read, or of another network.
        """
        if spec is None:
            return
        spec = spec if isinstance(spec, Spec) else Spec.from_dict(spec, "checkpoint")
        if spec.network != self.NAME:
            raise InputError(
                "checkpoint", f"a model of {spec.network}", f"Give one of {self.NAME}."
            )
        self._spec = spec
        self.hparams["spec"] = spec.as_dict()
        self.mean.copy_(torch.tensor(spec.mean))
        self.std.copy_(torch.tensor(spec.std))

    def spec_for(self, card: DataCard) -> Spec:
        """Spec of this network on a data set.

        Raises:
            InputError: A data card without statistics.
        """
        if card.mean is None or card.std is None:
            raise InputError(card.name, "the data card has no statistics", "Add mean and std.")
        return Spec(
            network=self.NAME,
            view=self.view_parameters(),
            mean=card.mean,
            std=card.std,
            classes=card.classes,
            rain=card.rain,
            threshold=self.hparams["threshold"],
            data=card.name,
            licence=card.licence,
            units=("m", "m", "m", card.intensity_unit),
        )

    def normalised(self, points: Tensor) -> Tensor:
        """Centres and scales raw points, float (M, 4), as the Spec says."""
        return (points - self.mean) / self.std

    def setup(self, stage: str) -> None:
        """Learns from the data what the Spec, the loss and the metrics need."""
        data: HasCard = self.trainer.datamodule  # type: ignore[attr-defined]
        self.card = data.card
        if self._spec is None and stage == "fit":
            self.adopt(self.spec_for(self.card))
        if (share := self.card.rain_share) is not None:
            self.class_weight.copy_(class_weights([1 - share, share]))
        self.metrics = RainMetrics(self.card.classes, self.card.rain)

    def on_load_checkpoint(self, checkpoint: dict[str, Any]) -> None:
        """Takes the Spec from the checkpoint that a run starts from.

        Raises:
            InputError: A checkpoint of something else.
        """
        spec = checkpoint.get("hyper_parameters", {}).get("spec")
        if spec is None:
            raise InputError("checkpoint", "it has no Spec", "Give a checkpoint of derain.")
        self.adopt(spec)

    def on_train_start(self) -> None:
        """Enters the run in TensorBoard's table of hyper-parameters, to be ranked by its IoU."""
        parameters = {
            name: value
            for name, value in self.hparams.items()
            if name != "spec" and not name.startswith("_")
        }
        for logger in self.loggers:
            if isinstance(logger, TensorBoardLogger):
                logger.log_hyperparams(parameters, {"hp_metric": 0.0})

    def training_step(self, batch: Batch) -> Tensor:
        """Loss of one batch."""
        return self._loss(batch, self(**batch.inputs), "train")

    def validation_step(self, batch: Batch) -> list[NDArray[np.float32]]:
        """Loss of one batch, its points counted, and the probability of each, as for predict."""
        logits = self(**batch.inputs)
        self._loss(batch, logits, "val")
        return self._count(batch, logits)

    def test_step(self, batch: Batch) -> None:
        """Counts the points of one batch."""
        self._count(batch, self(**batch.inputs))

    def predict_step(self, batch: Batch) -> list[NDArray[np.float32]]:
        """Probability of rain for every row of every scan, a list of float32 (N,)."""
        return self.probabilities(batch, self(**batch.inputs))

    def on_validation_epoch_start(self) -> None:
        """Forgets the scores of the last epoch, or of the sanity check."""
        self.metrics.reset()

    def on_validation_epoch_end(self) -> None:
        """Logs the scores of the epoch."""
        self._log_scores("val")

    def on_test_start(self) -> None:
        """Refuses to test on several devices, which share out the scans and count some twice.

        Raises:
            InputError: More than one device.
        """
        if self.trainer.world_size > 1:
            raise InputError(
                "--trainer.devices", "several would count some scans twice", "Test on one device."
            )

    def on_test_epoch_start(self) -> None:
        """Forgets the scores of another test."""
        self.metrics.reset()

    def on_test_epoch_end(self) -> None:
        """Logs the scores of the test; the metrics keep their counts for whoever reports them."""
        self._log_scores("test")

    def probabilities(self, batch: Batch, logits: Tensor) -> list[NDArray[np.float32]]:
        """Carries logits back to every row of every scan, as the deployed model does."""
        return [
            sample.view.back(probability_of_rain(scores.float().cpu().numpy()))
            for sample, scores in zip(batch.samples, batch.split(logits), strict=True)
        ]

    def _loss(self, batch: Batch, logits: Tensor, part: str) -> Tensor:
        assert batch.target is not None  # the data modules pair these scans with labels
        loss = segmentation_loss(logits, batch.target, self.class_weight)
        parts = {"loss": loss.total, "cross_entropy": loss.cross_entropy, "lovasz": loss.lovasz}
        self.log_dict(
            {f"{part}/{name}": value for name, value in parts.items()},
            on_step=False,
            on_epoch=True,
            sync_dist=True,
            batch_size=len(batch.samples),
        )
        return loss.total

    def _count(self, batch: Batch, logits: Tensor) -> list[NDArray[np.float32]]:
        probabilities = self.probabilities(batch, logits)
        for sample, probability in zip(batch.samples, probabilities, strict=True):
            scan = sample.scan
            self.metrics.update(
                predicted=torch.from_numpy(probability > self.spec.threshold).to(self.device),
                label=torch.from_numpy(scan.label).to(self.device),
                range=torch.from_numpy(scan.range).to(self.device),
                scan=torch.zeros(len(scan), dtype=torch.int64, device=self.device),
                scans=1,
            )
        return probabilities

    def _log_scores(self, part: str) -> None:
        scores = self.metrics.compute()
        self.log_dict({f"{part}/{name}": score for name, score in scores.items()})
        self.log(f"{part}_iou", scores["iou"], prog_bar=True, logger=False)
        if part == "val":
            self.log("hp_metric", scores["iou"])
