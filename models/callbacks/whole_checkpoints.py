"""Checkpoints of a training run, each written whole or not at all."""

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import lightning
import torch
from lightning.pytorch.plugins.io import TorchCheckpointIO
from torch import Tensor

from derain.errors import InputError
from derain.files.atomic import replacing
from derain.models.published import read_checkpoint


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
        """
        if "://" in str(path):
            return super().load_checkpoint(path, *arguments, **options)
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
    """Has a trainer write its checkpoints whole, unless it was told how to write them.

    Returns:
        The same trainer.
    """
    if type(trainer.strategy.checkpoint_io) is TorchCheckpointIO:
        trainer.strategy.checkpoint_io = WholeCheckpoints()
    return trainer
