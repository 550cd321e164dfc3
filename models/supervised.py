"""The base class of derainers that learn from labels: their loss."""

import sys
from collections.abc import Sequence

import torch
from torch import Tensor

from derain.cards.card import DataCard
from derain.cards.rain_found import require_rain
from derain.learning.batch import Batch
from derain.learning.losses import SegmentationLoss, class_weights, segmentation_loss
from derain.learning.task import Task, TrainingData
from derain.models.base import DerainingModule
from derain.scan import Scan
from derain.views.candidate_fit import fit_candidates
from derain.views.candidates import Candidates
from derain.views.view import IGNORED


class SupervisedModule(DerainingModule):
    """A derainer that learns rain from what is labelled as rain.

    Args:
        channels: Names of the network's input channels.
    """

    class_weight: Tensor

    def __init__(self, channels: Sequence[str]) -> None:
        super().__init__(channels)
        # Not in the state_dict: it comes from the data.
        self.register_buffer("class_weight", torch.ones(2), persistent=False)

    def setup(self, stage: str) -> None:
        """Agrees with the data.

        Raises:
            InputError: Data without rain, to be trained on.
        """
        super().setup(stage)
        if stage == "fit":
            require_rain(self._sees_rain(), self.card, "the training scans")

    def _sees_rain(self) -> bool:
        """True if a training scan has rain; those of plain loaders are not read."""
        data = self.trainer.datamodule  # type: ignore[attr-defined]
        if not (self.card.rain and isinstance(data, TrainingData)):
            return bool(self.card.rain)
        scans = data.training_scans(sys.maxsize, ())  # read one by one, to the first with rain
        return any(self.card.rain_of(scan).any() for scan in scans)

    def adopt_task(self, task: Task) -> None:
        """Takes over what was agreed with the data, and weighs the classes by their shares there.

        Of a network that judges candidates alone, they are the shares among them. How far the rarer
        class counts for more is set by ``balance``.

        Raises:
            InputError: A Spec of another network.
        """
        super().adopt_task(task)
        candidates = self.spec.candidates
        share = self.card.rain_share if candidates is None else candidates.rain_share
        if share is not None:
            weights = class_weights([1 - share, share])
            self.class_weight.copy_(weights ** self.hparams.get("balance", 1.0))

    def candidates_for(self, card: DataCard, scans: Sequence[Scan]) -> Candidates | None:
        """Bounds that hold as much of the training scans' rain as ``candidates`` states.

        Raises:
            InputError: ``candidates`` that is no share between 0 and 1.
        """
        inside = self.hparams.get("candidates")
        if inside is None or not scans:
            return None
        return fit_candidates(map(card.known_points, scans), self.channels, inside)

    def losses(self, batch: Batch) -> tuple[dict[str, Tensor], Tensor]:
        """Loss with its parts, and logits."""
        assert batch.target is not None  # the data modules pair these scans with labels
        logits = self.logits_of(batch)
        return self.segmentation_loss(logits, batch.target)._asdict(), logits

    def segmentation_loss(self, logits: Tensor, target: Tensor) -> SegmentationLoss:
        """Weighted cross-entropy and Lovász-softmax over the cells that hold something.

        Args:
            logits: Scores of every cell, float (M, 2).
            target: 1 for rain, 0 for everything else, ``IGNORED`` where there is nothing to
                judge, int64 (M,).
        """
        judged = target != IGNORED
        if judged.all():  # as of points, which are not to be copied for nothing
            return segmentation_loss(logits, target, self.class_weight)
        return segmentation_loss(logits[judged], target[judged], self.class_weight)
