"""Reading the weights that others published."""

from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

import torch
from torch import Tensor, nn
from torch.serialization import safe_globals

from derain.errors import InputError


class Inert:
    """Stands for what a checkpoint holds besides values: it is given anything and does nothing."""

    def __new__(cls, *_: object) -> Self:
        """An object that holds nothing."""
        return super().__new__(cls)

    def __init__(self, *_: object) -> None:
        """Forgets what it is given."""

    def __setstate__(self, _: object) -> None:
        """Forgets what it is given."""


# SalsaNext's training checkpoints hold a scheduler, which holds its optimiser and a bound method.
# Source: TiagoCortinhal/SalsaNext, trainer.py and warmupLR.py
TRAINER_STATE = ("torch.optim.lr_scheduler.CyclicLR", "torch.optim.sgd.SGD", "builtins.getattr")


def read_state_dict(path: Path) -> dict[str, Tensor]:
    """Reads a published state_dict, or a training checkpoint that holds one.

    The file is not trusted: only tensors and plain containers are unpickled.

    Raises:
        InputError: A missing file, or one that is not a state_dict of tensors.
    """
    content = read_checkpoint(path)
    tensors = content.get("state_dict", content)
    if not isinstance(tensors, Mapping) or not all(
        isinstance(key, str) and isinstance(tensor, Tensor) for key, tensor in tensors.items()
    ):
        raise InputError(path, "not a state_dict of tensors", "Give the published weights file.")
    return dict(tensors)


def read_checkpoint(path: Path) -> dict[str, Any]:
    """Unpickles tensors and plain containers onto the CPU, with nothing where trainers stood.

    Raises:
        InputError: A missing file, or one that holds anything else.
    """
    if not path.is_file():
        raise InputError(path, "no such file", "Check the path.")
    try:
        with safe_globals([dict, defaultdict, *((Inert, name) for name in TRAINER_STATE)]):
            content = torch.load(path, map_location="cpu", weights_only=True)
    except Exception as error:  # torch.load raises what its parts raise, from EOFError to zip's own
        # Not in torch's words, which advise to load it all the same.
        raise InputError(
            path,
            "damaged, or holds more than tensors and plain values",
            "Give a checkpoint or a state_dict.",
        ) from error
    if not isinstance(content, dict):
        raise InputError(path, f"holds a {type(content).__name__}", "Give a checkpoint.")
    return content


def published_tensors(
    state_dict: Mapping[str, Tensor], keys: Mapping[str, str], name: str
) -> dict[str, Tensor]:
    """Renames a published state_dict's tensors to ours.

    Args:
        state_dict: Published tensors, whose keys may begin with ``module.``.
        keys: Published key of each of our parameters.
        name: Name of the network, for messages.

    Raises:
        InputError: Missing or surplus keys.
    """
    tensors = {key.removeprefix("module."): tensor for key, tensor in state_dict.items()}
    missing = sorted(set(keys.values()) - set(tensors))
    surplus = sorted(set(tensors) - set(keys.values()))
    if missing or surplus:
        raise _of_another_network(
            name,
            f"{len(missing)} keys missing, such as {missing[:2]}; "
            f"{len(surplus)} not known, such as {surplus[:2]}",
        )
    return {ours: tensors[published] for ours, published in keys.items()}


def load_tensors(network: nn.Module, tensors: Mapping[str, Tensor], name: str) -> None:
    """Gives a network its tensors.

    Args:
        network: The network.
        tensors: What :func:`published_tensors` gave.
        name: Name of the network, for messages.

    Raises:
        InputError: Tensors of other shapes.
    """
    try:
        network.load_state_dict(tensors)
    except RuntimeError as error:
        raise _of_another_network(name, str(error)) from error


def _of_another_network(name: str, difference: str) -> InputError:
    return InputError(
        name,
        f"the state_dict is of another network ({difference})",
        f"Give weights published for {name}.",
    )
