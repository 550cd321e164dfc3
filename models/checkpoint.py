"""Checkpoints on disk: every model of derain, by the name in its Spec."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import lightning

from derain.documents import shown
from derain.errors import InputError
from derain.models.base import DerainingModule
from derain.models.lisnownet import LiSnowNet
from derain.models.outdet import OutDet
from derain.models.published import MISFITS, read_checkpoint, with_tensors
from derain.models.salsanext import SalsaNext
from derain.models.whole_checkpoints import save_whole
from derain.spec import Spec

MODELS: dict[str, type[DerainingModule]] = {
    model.NAME: model for model in (OutDet, SalsaNext, LiSnowNet)
}


def load_model(path: Path) -> DerainingModule:
    """Reads a checkpoint that derain wrote. It is not trusted: only plain values are unpickled.

    Raises:
        InputError: A missing or damaged file, or a checkpoint of something else.
    """
    content = read_checkpoint(path)
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
    if spec.network not in MODELS:
        raise InputError(
            path, f"a checkpoint of {shown(spec.network)}", f"Known are {', '.join(MODELS)}."
        )
    # Lightning's own entries begin with an underscore.
    arguments = {k: v for k, v in parameters.items() if not str(k).startswith("_")}
    try:
        model = with_tensors(lambda: MODELS[spec.network](**arguments), weights)
    except MISFITS as error:
        raise InputError(
            path,
            f"its weights do not fit {spec.network} ({error})",
            "Train or import the model again.",
        ) from error
    return model.eval()


def save_model(model: DerainingModule, path: Path) -> None:
    """Writes a checkpoint as a training run would, for ``derain test``, ``fit`` and ``export``.

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
