"""Checkpoints on disk: written whole, and read without trust."""

import logging
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import lightning

from derain.errors import InputError, did_you_mean
from derain.files.documents import shown
from derain.models.base import DerainingModule
from derain.models.callbacks.whole_checkpoints import save_whole
from derain.models.published import MISFITS, read_checkpoint, with_tensors
from derain.models.registry import NETWORKS
from derain.spec import Spec

# What Lightning asks of a checkpoint that a training goes on from.
STATE_OF_TRAINING = {"optimizer_states", "lr_schedulers", "loops"}


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
        InputError: What `load_model` raises, or a checkpoint without the state of a training.
    """
    content = read_checkpoint(path)
    _model_of(content, path)
    if not content.keys() >= STATE_OF_TRAINING:
        raise InputError(
            path,
            "holds weights alone, no state of a training to go on from",
            "Go on from the last.ckpt of a run, or train anew without --ckpt_path.",
        )


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
            "Published weights become one through `derain import-weights`.",
        )
    spec = Spec.from_dict(parameters["spec"], path)
    if spec.network not in NETWORKS:
        raise InputError(
            path,
            f"a checkpoint of {shown(spec.network)}, a network that no installed package brings",
            f"{did_you_mean(spec.network, NETWORKS)}Install the package that names it among the "
            f"entry points `{NETWORKS.group}`. Known are {', '.join(NETWORKS)}.",
        )
    # Lightning's own entries begin with an underscore.
    arguments = {k: v for k, v in parameters.items() if not str(k).startswith("_")}
    try:
        model = with_tensors(lambda: NETWORKS[spec.network](**arguments), weights)
    except MISFITS as error:
        raise InputError(
            path,
            f"its weights do not fit {spec.network} ({error})",
            "Train or import the model again.",
        ) from error
    return model.eval()


def save_model(model: DerainingModule, path: Path) -> None:
    """Writes weights and Spec as a training run would, for all that uses or measures a model.

    No training goes on from it, for it holds no state of one.

    Raises:
        InputError: An output that cannot be written.
    """
    # LightningCLI finds the class of a checkpoint's model by this name.
    model.hparams["_class_path"] = f"{type(model).__module__}.{type(model).__qualname__}"
    with _quiet():
        trainer = lightning.Trainer(
            accelerator="cpu", logger=False, enable_checkpointing=False, enable_model_summary=False
        )
    trainer.strategy.connect(model)
    save_whole(trainer).save_checkpoint(path, weights_only=True)


@contextmanager
def _quiet() -> Iterator[None]:
    """Keeps the trainer from telling of its hardware: it does nothing but write."""
    logger = logging.getLogger("lightning.pytorch.utilities.rank_zero")
    level = logger.level
    logger.setLevel(logging.ERROR)
    try:
        yield
    finally:
        logger.setLevel(level)
