"""The states that a resumed run takes over from its checkpoint: those that match its own.

Checkpoints are not trusted.
"""

import math
from collections.abc import Mapping
from copy import deepcopy
from typing import Any

import lightning
import torch
from lightning.pytorch.callbacks import ModelCheckpoint
from torch import Tensor
from torch.optim import Optimizer

from derain.errors import InputError, counted
from derain.files.documents import Entry
from derain.models.callbacks.best_checkpoint import BestCheckpoint

# Of epochs, batches and steps: more than any training takes, and a number that a float holds.
LARGEST_COUNT = 2**53

REMEDY = "Give a checkpoint of the same network, as derain wrote it."


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
            InputError: Loops, optimisers, schedulers or a scaler of another training, one that has
                reached its last epoch, or a learning rate that is planned for another number of
                steps.
        """
        checkpoint, self._checkpoint = self._checkpoint, None
        if checkpoint is None:
            return
        precision = trainer.precision_plugin
        own: dict[str, Any] = {
            "loops": {"fit_loop": trainer.fit_loop.state_dict()},
            "optimizer_states": [_state_after_a_step(each) for each in trainer.optimizers],
            "lr_schedulers": [each.scheduler.state_dict() for each in trainer.lr_scheduler_configs],
            type(precision).__qualname__: precision.state_dict(),
        }
        checkpoint.pop("native_amp_scaling_state", None)  # of Lightning before 1.6
        whole = {name: Entry(str(trainer.ckpt_path), name, checkpoint.get(name)) for name in own}
        for name in own.keys() & checkpoint.keys():
            checkpoint[name] = matching_state(whole[name], own[name])
        epochs = checkpoint["loops"]["fit_loop"]["epoch_progress"]["current"]["processed"]
        if 0 <= (trainer.max_epochs or -1) <= epochs:
            raise InputError(
                str(trainer.ckpt_path),
                f"has {counted(epochs, 'epoch')} already, of {trainer.max_epochs}",
                "Use it as it is, raise --trainer.max_epochs, or begin a new training by --start.",
            )
        for found, schedule in zip(checkpoint["lr_schedulers"], own["lr_schedulers"], strict=True):
            planned, steps = found.get("total_steps"), schedule.get("total_steps")
            if planned != steps:
                raise whole["lr_schedulers"].fault(
                    f"plans the learning rate for {planned} steps, where this run takes {steps}",
                    "Keep max_epochs, and processes times batch_size, as they were.",
                )
        if _orders(checkpoint["optimizer_states"]) != _orders(own["optimizer_states"]):
            raise whole["optimizer_states"].fault("orders parameters otherwise", REMEDY)


def _orders(states: list[dict[str, Any]]) -> list[Any]:
    return [group["params"] for state in states for group in state["param_groups"]]


def _state_after_a_step(optimizer: Optimizer) -> dict[str, Any]:
    """The state that an optimiser has once it has stepped; the optimiser itself stays as it is."""
    trial = deepcopy(optimizer)
    for group in trial.param_groups:
        for parameter in group["params"]:
            parameter.grad = torch.zeros_like(parameter)
    trial.step()
    return trial.state_dict()


def matching_state(found: Entry, own: Any) -> Any:
    """A state from a checkpoint, reduced to the entries of the run's own state.

    Lightning and torch enter whatever a checkpoint holds into their own objects.

    Args:
        found: The state in the checkpoint. It is not trusted.
        own: The state of the same object before it is restored.

    Returns:
        The found value, without keys that the own state lacks. Names that begin with an underscore
        may be missing, for they differ between versions of torch.

    Raises:
        InputError: Keys missing, lists of another length, tensors of another shape, or values of
            another kind; a number that is negative or not finite where the own number is neither.
    """
    try:
        return _matching(found.value, own)
    except ValueError as error:
        raise found.fault("does not fit this training", REMEDY) from error


def _matching(found: Any, own: Any) -> Any:
    if isinstance(own, Mapping) and isinstance(found, Mapping):
        public = {key for key in own if isinstance(key, str) and not key.startswith("_")}
        if public <= found.keys():
            parts = {key: _matching(found[key], own[key]) for key in found if key in own}
            return type(own)(parts)  # type: ignore[call-arg]  # a dict or a Counter
    elif isinstance(own, list | tuple) and isinstance(found, list | tuple):
        return type(found)([_matching(*pair) for pair in zip(found, own, strict=True)])
    elif _fits(found, own):
        return found
    raise ValueError


def _fits(found: Any, own: Any) -> bool:
    """True if a value may stand in the place of another one."""
    if isinstance(own, Tensor) and isinstance(found, Tensor):
        kinds = [(each.shape, each.layout, each.is_floating_point()) for each in (found, own)]
        return kinds[0] == kinds[1] and bool(found.isfinite().all() or not own.isfinite().all())
    if type(found) not in ((int, float) if isinstance(own, float) else (type(own),)):
        return False
    if type(own) not in (int, float):
        return True
    if not math.isfinite(own):  # such as the best score before there is one
        return not math.isnan(found)
    return abs(found) <= LARGEST_COUNT and (found >= 0 or own < 0)
