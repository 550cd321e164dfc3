"""The states that a resumed run takes over from its checkpoint: those that match its own."""

import math
from collections.abc import Mapping
from copy import deepcopy
from typing import Any

import lightning
import torch
from lightning.pytorch.callbacks import ModelCheckpoint
from torch import Tensor
from torch.optim import Optimizer

from derain.errors import InputError
from derain.files.documents import Entry, shown
from derain.models.callbacks.best_checkpoint import BestCheckpoint
from derain.models.limits import LARGEST_COMPUTABLE

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
    value = found.value
    if isinstance(own, Mapping) and isinstance(value, Mapping):
        return _like_mapping(found, own)
    if isinstance(own, list | tuple) and isinstance(value, list | tuple) and len(own) == len(value):
        parts = [matching_state(_part(found, key), part) for key, part in enumerate(own)]
        return tuple(parts) if isinstance(value, tuple) else parts
    if isinstance(own, Tensor) and isinstance(value, Tensor):
        _refuse_another_tensor(found, own)
    elif isinstance(own, int | float) and not isinstance(own, bool):
        _refuse_another_number(found, own)
    elif type(own) is not type(value) or isinstance(own, list | tuple):
        raise found.fault(f"{shown(value)} does not fit this training", REMEDY)
    return value


def _like_mapping(found: Entry, own: Mapping[Any, Any]) -> Any:
    public = {key for key in own if isinstance(key, str) and not key.startswith("_")}
    if missing := public - found.value.keys():
        raise found.fault(f"{min(missing)} is missing", REMEDY)
    taken = {key: matching_state(_part(found, key), own[key]) for key in found.value if key in own}
    return type(own)(taken)  # type: ignore[call-arg]  # a dict or a Counter


def _part(whole: Entry, key: Any) -> Entry:
    return Entry(whole.source, f"{whole.key}.{key}", whole.value[key])


def _refuse_another_tensor(found: Entry, own: Tensor) -> None:
    value = found.value
    fits = value.shape == own.shape and value.is_floating_point() == own.is_floating_point()
    if not fits or value.layout != own.layout:
        raise found.fault(f"a tensor of shape {tuple(value.shape)} does not fit", REMEDY)
    if own.isfinite().all() and not value.isfinite().all():
        raise found.fault("holds numbers that are not finite", REMEDY)


def _refuse_another_number(found: Entry, own: float) -> None:
    if not math.isfinite(own):  # such as the best score before there is one
        if type(found.value) not in (int, float) or math.isnan(found.value):
            raise found.fault(f"{shown(found.value)} is not a number", REMEDY)
        return
    try:
        number = found.number()
    except InputError as error:
        raise found.fault(error.reason, REMEDY) from error
    if isinstance(own, int) and not isinstance(found.value, int):
        raise found.fault(f"{number:g} is not a whole number", REMEDY)
    if number < 0 <= own:
        raise found.fault(f"{number:g} is negative", REMEDY)
    if abs(number) > (LARGEST_COUNT if isinstance(own, int) else LARGEST_COMPUTABLE):
        raise found.fault(f"{number:g} is too large", REMEDY)
