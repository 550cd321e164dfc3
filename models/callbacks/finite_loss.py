"""Stops a training whose loss is no longer a number."""

from typing import Any

import lightning
import torch
from torch import Tensor

from derain.errors import InputError


class FiniteLoss(lightning.Callback):
    """Stops a training before it saves what no training can mend.

    The losses are added up where they are computed, and the sum is looked at as often as the
    trainer logs, before each validation and after each epoch: a graphics card is not waited for at
    every step. All processes stop together.
    """

    _sum: Tensor | None = None  # of the losses since the last check

    def on_train_start(self, trainer: lightning.Trainer, pl_module: Any) -> None:
        """Resets the check."""
        self._sum = torch.zeros((), device=trainer.strategy.root_device)

    def on_train_batch_end(
        self, trainer: lightning.Trainer, pl_module: Any, outputs: Any, *_: Any
    ) -> None:
        """Adds up the loss of a batch.

        Raises:
            InputError: A loss was not finite.
        """
        if outputs and "loss" in outputs:  # not of a step that was left out
            self._sum += outputs["loss"].detach()
        every: int = trainer.log_every_n_steps  # type: ignore[attr-defined]
        if every > 0 and trainer.global_step % every == 0:
            self._check(trainer)

    def on_validation_start(self, trainer: lightning.Trainer, pl_module: Any) -> None:
        """Checks before the validation, after which a checkpoint is saved.

        Raises:
            InputError: A loss was not finite.
        """
        self._check(trainer)

    def on_train_epoch_end(self, trainer: lightning.Trainer, pl_module: Any) -> None:
        """Checks before the last checkpoint is saved.

        Raises:
            InputError: A loss was not finite.
        """
        self._check(trainer)

    def _check(self, trainer: lightning.Trainer) -> None:
        if self._sum is None:  # before the first step
            return
        finite = bool(self._sum.isfinite())
        if not trainer.strategy.reduce_boolean_decision(finite, all=True):
            raise InputError(
                "training",
                f"the loss is not finite after {trainer.global_step:,} steps",
                "Lower --model.learning_rate; checkpoints saved before are as they were.",
            )
        self._sum.zero_()
