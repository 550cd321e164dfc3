"""Weights that others published: which networks take them, and how they are read."""

import warnings
from abc import ABC, abstractmethod
from collections import defaultdict
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, BinaryIO, Self, TypeVar
from zipfile import ZipFile, is_zipfile

import torch
from torch import Tensor, nn
from torch.serialization import safe_globals

from derain.cards.card import DataCard
from derain.errors import InputError
from derain.files.reading import reading
from derain.models.former_names import with_current_names

Network = TypeVar("Network", bound=nn.Module)

# What torch lets out where a network cannot be made with some arguments, or not with some tensors.
LOAD_ERRORS = (TypeError, ValueError, AttributeError, RuntimeError, ArithmeticError)


class Published(ABC):
    """A derainer with published weights, for ``derain import-weights``."""

    @classmethod
    @abstractmethod
    def from_published(
        cls, state_dict: Mapping[str, Tensor], card: DataCard, grid: str | None = None
    ) -> Self:
        """Builds the derainer from published weights.

        Args:
            state_dict: Published tensors.
            card: Data card whose statistics they were trained with.
            grid: Name of the grid they were trained on, for networks that see range images.

        Raises:
            InputError: Weights of another network, or a grid missing or surplus.
        """


class Placeholder:
    """Stands for what a checkpoint holds besides values: it is given anything and does nothing."""

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
    with reading(path), path.open("rb") as file:
        return unpickled(file, path)


def unpickled(file: BinaryIO, name: Path | str) -> dict[str, Any]:
    """Unpickles a checkpoint as :func:`read_checkpoint` does.

    Args:
        file: The checkpoint, open.
        name: Its path or address, for errors.

    Raises:
        InputError: It holds anything else, or is an ONNX file.
    """
    if Path(name).suffix == ".onnx":
        raise InputError(
            name,
            "is an ONNX file, whose weights are folded for deployment",
            "Give its checkpoint: student.ckpt in the folder of `derain learn`, or best.ckpt in "
            "the checkpoints of the run.",
        )
    try:
        _refuse_compressed(file)
        placeholders = [(Placeholder, state) for state in TRAINER_STATE]
        with (
            safe_globals([dict, defaultdict, *placeholders]),
            warnings.catch_warnings(action="ignore"),  # torch also warns of what it refuses
        ):
            content = torch.load(file, map_location="cpu", weights_only=True)
    except Exception as error:  # torch.load raises what its parts raise, zip's own included
        # Not in torch's words, which advise to load it all the same.
        raise InputError(
            name,
            "damaged, or holds more than tensors and plain values",
            "Give a checkpoint or a state_dict.",
        ) from error
    if not isinstance(content, dict):
        raise InputError(name, f"holds a {type(content).__name__}", "Give a checkpoint.")
    return with_current_names(content)


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


def with_tensors(make: Callable[[], Network], tensors: Mapping[str, Tensor]) -> Network:
    """A network with tensors from a file that is not trusted, which also states its size.

    Args:
        make: Makes the network.
        tensors: Its state_dict.

    Raises:
        One of LOAD_ERRORS: A network that cannot be made, or tensors that are not its own.
    """
    with torch.device("meta"), warnings.catch_warnings():
        # Here tensors have a shape and no memory: none is taken for a network of another size.
        warnings.simplefilter("ignore")
        shapes = make()
        shapes.load_state_dict(tensors)
    ours = shapes.state_dict()
    for name, tensor in tensors.items():
        if tensor.is_floating_point() != ours[name].is_floating_point():
            raise TypeError(f"{name} is of {tensor.dtype}")
    network = make()
    network.load_state_dict(tensors)
    return network


def network_of(make: Callable[[], Network], tensors: Mapping[str, Tensor], name: str) -> Network:
    """A network with published tensors.

    Args:
        make: Makes the network.
        tensors: A result of :func:`published_tensors`.
        name: Name of the network, for messages.

    Raises:
        InputError: Tensors of other shapes.
    """
    try:
        return with_tensors(make, tensors)
    except LOAD_ERRORS as error:
        raise _of_another_network(name, str(error)) from error


def _refuse_compressed(file: BinaryIO) -> None:
    """Refuses an archive that may hold far more than its size, which torch writes none of."""
    if is_zipfile(file):
        with ZipFile(file) as archive:
            if any(part.compress_size != part.file_size for part in archive.infolist()):
                raise ValueError("compressed")
    file.seek(0)


def _of_another_network(name: str, difference: str) -> InputError:
    return InputError(
        name,
        f"the state_dict is of another network ({difference})",
        f"Give weights published for {name}.",
    )
