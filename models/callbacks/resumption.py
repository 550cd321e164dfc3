"""The states that a resumed run takes over from its checkpoint: those that match its own."""

from copy import deepcopy
from typing import Any

import lightning
import torch
from lightning.pytorch.callbacks import ModelCheckpoint
from torch.optim import Optimizer

from derain.files.documents import Entry
from derain.models.callbacks.best_checkpoint import BestCheckpoint
from derain.models.saved_state import REMEDY, matching_state


class Resumption(lightning.Callback):
    """Reduces a checkpoint to states that are like the run's own, before Lightning restores them.

    Source: Lightning 2.6, ``Trainer._run``: callbacks are restored before ``on_fit_start``, loops,
    optimisers and schedulers after it.
    """

    _checkpoint: dict[str, Any] | None = None

    def on_load_checkpoint(
        self, trainer: lightning.Trainer, pl_module: Any, checkpoint: dict[str, Any]
    ) -> None:
        """Takes over the states of callbacks, except for paths of files.

        Lightning's ModelCheckpoint would remove any file that its state names, and is given none;
        :class:`BestCheckpoint` takes over those of its own.

        Raises:
            InputError: A state of another kind than the callback has.
        """
        states = checkpoint["callbacks"]
        for callback in trainer.callbacks:  # type: ignore[attr-defined]
            key = callback.state_key
            if key not in states or isinstance(callback, BestCheckpoint):
                continue
            if isinstance(callback, ModelCheckpoint):
                del states[key]
            else:
                found = Entry(str(trainer.ckpt_path), f"callbacks.{key}", states[key])
                states[key] = matching_state(found, callback.state_dict())
        self._checkpoint = checkpoint

    def on_fit_start(self, trainer: lightning.Trainer, pl_module: Any) -> None:
        """Compares what Lightning restores next with what the run has.

        Raises:
            InputError: Optimisers, schedulers or a scaler of another training, or a learning rate
                that is planned for another number of steps.
        """
        checkpoint, self._checkpoint = self._checkpoint, None
        if checkpoint is None:
            return
        precision = trainer.precision_plugin
        schedulers = [config.scheduler for config in trainer.lr_scheduler_configs]
        optimizers = [_state_after_a_step(each) for each in trainer.optimizers]
        own: dict[str, Any] = {
            "optimizer_states": optimizers,
            "lr_schedulers": [scheduler.state_dict() for scheduler in schedulers],
            type(precision).__qualname__: precision.state_dict(),
        }
        checkpoint.pop("native_amp_scaling_state", None)  # of Lightning before 1.6
        whole = {name: Entry(str(trainer.ckpt_path), name, checkpoint.get(name)) for name in own}
        for name in own.keys() & checkpoint.keys():
            checkpoint[name] = matching_state(whole[name], own[name])
        for found, schedule in zip(checkpoint["lr_schedulers"], own["lr_schedulers"], strict=True):
            planned, steps = found.get("total_steps"), schedule.get("total_steps")
            if planned != steps:
                raise whole["lr_schedulers"].fault(
                    f"plans the learning rate for {planned} steps, where this run takes {steps}",
                    "Keep max_epochs, and processes times batch_size, as they were.",
                )
        for found, state in zip(checkpoint["optimizer_states"], optimizers, strict=True):
            if _order(found) != _order(state):
                raise whole["optimizer_states"].fault("orders parameters otherwise", REMEDY)


def _order(state: dict[str, Any]) -> list[Any]:
    return [group["params"] for group in state["param_groups"]]


def _state_after_a_step(optimizer: Optimizer) -> dict[str, Any]:
    """The state that an optimiser has once it has stepped; the optimiser itself stays as it is."""
    trial = deepcopy(optimizer)
    for group in trial.param_groups:
        for parameter in group["params"]:
            parameter.grad = torch.zeros_like(parameter)
    trial.step()
    return trial.state_dict()
