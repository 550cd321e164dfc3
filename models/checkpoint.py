"""Checkpoints on disk: written whole, read without trust, and begun from."""

import io
import re
from collections.abc import Mapping
from hashlib import sha256
from inspect import signature
from pathlib import Path
from typing import Any

import lightning
import torch
from lightning.fabric.utilities.cloud_io import get_filesystem
from lightning.pytorch.plugins.io import TorchCheckpointIO
from torch import Tensor

from derain.errors import InputError, did_you_mean
from derain.files.atomic import replacing
from derain.files.documents import Entry, shown
from derain.files.reading import reading
from derain.learning.start import Start
from derain.models.base import DerainingModule
from derain.models.callbacks.resumption import LARGEST_COUNT, REMEDY
from derain.models.limits import check_hyperparameters
from derain.models.published import LOAD_ERRORS, read_checkpoint, unpickled, with_tensors
from derain.models.registry import NETWORKS
from derain.spec import Spec

# Entries that Lightning requires in a checkpoint to resume a training.
TRAINING_STATE = {"optimizer_states", "lr_schedulers", "loops", "callbacks"}

# Versions from 2.0 on: Lightning rewrites the checkpoints of those before, and none is derain's.
# Source: PEP 440.
LIGHTNING_VERSION = re.compile(r"([2-9]|[1-9]\d+)(\.\d+)+((a|b|rc|\.post|\.?dev)\d+)?(\+[\w.]+)?")

# Digits of a checksum that distinguish one checkpoint from others.
CHECKSUM_DIGITS = 12


def load_model(path: Path | str) -> DerainingModule:
    """Reads a checkpoint that derain wrote. It is not trusted: only plain values are unpickled.

    Example:
        >>> model = load_model("model.ckpt")
        >>> type(model).__name__, model.spec.data
        ('OutDet', 'WADS')

    Raises:
        InputError: A missing or damaged file, or a checkpoint of something else.
    """
    path = Path(path)
    return _model_of(read_checkpoint(path), path)


def check_resumable(path: Path) -> None:
    """Finds out whether a training can go on from a checkpoint.

    Raises:
        InputError: The errors of `load_model`, or a checkpoint without the state of a training.
    """
    content = read_checkpoint(path)
    _model_of(content, path)
    if not content.keys() >= TRAINING_STATE:
        raise InputError(
            path,
            "holds weights alone, without the state of a training to resume",
            "Resume from the last.ckpt of a run, or train again without --ckpt_path.",
        )


def network_of_checkpoint(path: Path) -> tuple[type[DerainingModule], dict[str, Any]]:
    """The class of a checkpoint's network, by its name in the registry, and its arguments.

    Raises:
        InputError: The errors of `load_model`.
    """
    content = read_checkpoint(path)
    model = _model_of(content, path)
    return type(model), _arguments(content["hyper_parameters"])


def class_path(network: type[DerainingModule]) -> str:
    """The name by which a configuration finds the class of a network."""
    return f"{network.__module__}.{network.__qualname__}"


def started(model: DerainingModule, checkpoint: Path, name: str) -> DerainingModule:
    """A model of the same kind that begins where another one has ended.

    Network, channels, view and normalisation are those of the checkpoint; how it is trained, and
    its threshold and candidates, are the model's (its ``RECIPE``).

    Example:
        >>> recipe = OutDet(neighbours=5, learning_rate=0.002)
        >>> student = started(recipe, Path("model.ckpt"), "mine")
        >>> student.hparams["neighbours"], student.hparams["learning_rate"]
        (9, 0.002)

    Args:
        model: A model that has not been trained.
        checkpoint: A checkpoint that derain wrote.
        name: What the Spec calls it.

    Raises:
        InputError: A checkpoint that cannot be read, or one of another network.
    """
    source = load_model(checkpoint)
    if type(source) is not type(model):
        raise InputError(
            checkpoint,
            f"a model of {source.NAME}, from which {model.NAME} cannot start",
            f"Train {source.NAME}, or give a checkpoint of {model.NAME}.",
        )
    arguments = {
        argument: own if argument in model.RECIPE else source.hparams.get(argument, own)
        for argument, own in _arguments(model.hparams).items()
        if argument != "spec"
    }
    student = type(model)(**arguments)
    student.load_state_dict(source.state_dict())
    # By what Lightning's command line has entered there, it reads a checkpoint back.
    student.hparams.update({key: own for key, own in model.hparams.items() if key[0] == "_"})
    with reading(checkpoint):
        checksum = sha256(checkpoint.read_bytes()).hexdigest()[:CHECKSUM_DIGITS]
    student.start = Start(f"{name} ({checksum})", source.spec)
    return student


def save_model(model: DerainingModule, path: Path) -> None:
    """Writes weights and Spec as a training run would, for all that uses or measures a model.

    No training can resume from it: it holds no state of one.

    Raises:
        InputError: An output that cannot be written.
    """
    # Lightning's own command line would find the class by this name; derain's does not ask it.
    model.hparams["_class_path"] = class_path(type(model))
    content = {
        "epoch": 0,
        "global_step": 0,
        "pytorch-lightning_version": lightning.__version__,
        "state_dict": model.state_dict(),
        "hyper_parameters": dict(model.hparams),
    }
    WholeCheckpoints().save_checkpoint(content, path)


class WholeCheckpoints(TorchCheckpointIO):
    """Writes checkpoints as Lightning does, but beside their place, and then into it.

    Lightning writes to the system's folder of temporary files. Between file systems the move from
    there is a copy, which a full disk or a kill cuts short under the checkpoint's own name, when
    the one before it is lost already.
    """

    def save_checkpoint(
        self, checkpoint: dict[str, Any], path: str | Path, storage_options: Any | None = None
    ) -> None:
        """Writes a checkpoint; one that is there is replaced at the end.

        Raises:
            InputError: It cannot be written, or its weights are not finite; what was there stays.
        """
        refuse_not_finite(checkpoint.get("state_dict", {}), Path(path))
        if "://" in str(path) or storage_options is not None:  # not a file of this system's
            super().save_checkpoint(checkpoint, path, storage_options)
            return
        content = io.BytesIO()  # torch hides what goes wrong where it writes itself
        torch.save(checkpoint, content)
        with replacing(Path(path)) as temporary:
            temporary.write_bytes(content.getbuffer())

    def load_checkpoint(self, path: str | Path, *arguments: Any, **options: Any) -> dict[str, Any]:
        """Reads a checkpoint onto the CPU. It is not trusted: only plain values are unpickled.

        Raises:
            InputError: A missing file, or one that holds anything else.
            OSError: An address that cannot be read.
        """
        if "://" in str(path):
            with get_filesystem(path).open(str(path), "rb") as file:
                return unpickled(file, str(path))
        return read_checkpoint(Path(path))


def refuse_not_finite(weights: Mapping[str, Tensor], path: Path) -> None:
    """Refuses weights that no training can mend and that judge no scan.

    Raises:
        InputError: Some weights are NaN or infinite.
    """
    for name, tensor in weights.items():
        if not tensor.isfinite().all():
            raise InputError(
                path,
                f"the weights {name} are not finite",
                "Train again with a lower learning rate.",
            )


def save_whole(trainer: lightning.Trainer) -> lightning.Trainer:
    """Has a trainer write its checkpoints whole, unless it was given another way to write them.

    Returns:
        The same trainer.
    """
    if type(trainer.strategy.checkpoint_io) is TorchCheckpointIO:
        trainer.strategy.checkpoint_io = WholeCheckpoints()
    return trainer


def _model_of(content: Mapping[str, Any], path: Path) -> DerainingModule:
    parameters, weights = content.get("hyper_parameters"), content.get("state_dict")
    if not (
        isinstance(parameters, dict)
        and isinstance(parameters.get("spec"), dict)
        and isinstance(weights, dict)
    ):
        raise InputError(
            path,
            "not a checkpoint of derain",
            "Convert published weights with `derain import-weights`.",
        )
    spec = Spec.from_dict(parameters["spec"], path)
    if spec.network not in NETWORKS:
        raise InputError(
            path,
            f"a checkpoint of {shown(spec.network)}, a network that no installed package provides",
            f"{did_you_mean(spec.network, NETWORKS)}Install the package that names it among the "
            f"entry points `{NETWORKS.group}`. Available: {', '.join(NETWORKS)}.",
        )
    network, arguments = NETWORKS[spec.network], _arguments(parameters)
    defaults = {name: each.default for name, each in signature(network).parameters.items()}
    try:
        _check_progress(content, path)
        check_hyperparameters(Entry(path, "hyper_parameters", arguments).members(), defaults)
    except InputError as error:
        raise InputError(error.subject, error.reason, REMEDY) from error
    try:
        model = with_tensors(lambda: network(**arguments), weights)
    except LOAD_ERRORS as error:
        raise InputError(
            path,
            f"its weights do not fit {spec.network} ({error})",
            "Train or import the model again.",
        ) from error
    refuse_not_finite(model.state_dict(), path)
    return model.eval()


def _arguments(parameters: Mapping[Any, Any]) -> dict[str, Any]:
    """Arguments of a network; Lightning's own entries begin with an underscore."""
    return {k: v for k, v in parameters.items() if not str(k).startswith("_")}


def _check_progress(content: Mapping[str, Any], path: Path) -> None:
    """Refuses what Lightning reads of every checkpoint besides the model, where it cannot.

    What a training goes on from, :class:`Resumption` compares with the training's own.

    Raises:
        InputError: Another version of Lightning, or parts of another kind than Lightning writes.
    """
    version = content.get("pytorch-lightning_version")
    if not isinstance(version, str) or not LIGHTNING_VERSION.fullmatch(version):
        raise InputError(path, f"written by Lightning {shown(version)}", REMEDY)
    for name in ("epoch", "global_step"):
        Entry(path, name, content.get(name)).whole(0, LARGEST_COUNT)
    for state in Entry(path, "callbacks", content.get("callbacks", {})).members().values():
        state.members()
