"""The best checkpoint of a training run, which a resumed run takes along."""

import os
import re
import shutil
from collections.abc import Mapping
from contextlib import suppress
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import lightning
import torch
from lightning.pytorch.callbacks import ModelCheckpoint
from torch import Tensor

from derain.errors import InputError
from derain.files.atomic import replacing
from derain.files.documents import shown
from derain.models.former_names import current_monitor
from derain.system.notices import warn


class BestCheckpoint(ModelCheckpoint):
    """Keeps the best epochs, also of a run resumed in a folder of its own.

    Lightning forgets what was best when the folder changes, and calls the first epoch there the
    best, however poor. This one goes on with the scores and with copies of the files; those of the
    earlier run stay.

    Lightning removes files that it has kept once there are better ones, and a checkpoint is not
    trusted to name them. So they are looked for beside the checkpoint, or in the run's own folder
    where it wrote there before, and only under names that this callback gives.
    """

    _earlier: Mapping[str, Any] | None = None  # state of the run that this one goes on from

    def setup(self, trainer: lightning.Trainer, pl_module: Any, stage: str) -> None:
        """Takes the monitor's current name for the one in a configuration of an earlier version.

        A training of fewer epochs than there are between two validations ends with one: without,
        nothing of it would be kept.
        """
        if self.monitor is not None:
            self.monitor = current_monitor(self.monitor)
        epochs, between = trainer.max_epochs, trainer.check_val_every_n_epoch
        if epochs is not None and between is not None and 0 < epochs < between:
            trainer.check_val_every_n_epoch = epochs
        super().setup(trainer, pl_module, stage)

    @property
    def state_key(self) -> str:
        """The key of its state in checkpoints: Lightning's, so that old runs can be resumed."""
        return super().state_key.replace(type(self).__qualname__, ModelCheckpoint.__qualname__, 1)

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Keeps the state until the training starts, if it does."""
        self._earlier = state_dict

    def on_train_start(self, trainer: lightning.Trainer, pl_module: Any) -> None:
        """Goes on with what was best before.

        Raises:
            InputError: A state that holds no scores of checkpoints, or a copy cannot be written.
        """
        super().on_train_start(trainer, pl_module)
        if self._earlier is not None and not trainer.fast_dev_run:  # type: ignore[attr-defined]
            self._go_on_from(trainer, self._earlier)
        self._earlier = None

    def _go_on_from(self, trainer: lightning.Trainer, earlier: Mapping[str, Any]) -> None:
        before, scores = _folder_and_scores(earlier, trainer.ckpt_path)
        folder = Path(trainer.ckpt_path or "").parent if before != self.dirpath else Path(before)
        kept: dict[str, Tensor] = {}  # the best first
        ranking = sorted(scores, key=lambda path: float(scores[path]), reverse=self.mode == "max")
        for path in ranking[: None if self.save_top_k < 0 else self.save_top_k]:
            name = os.path.relpath(path, before)
            copy = os.path.join(str(self.dirpath), name)
            if _copied(trainer, self._own_file(folder, name), copy):
                kept[copy] = scores[path]
            elif trainer.is_global_zero:
                warn(f"{path}: not found; the best checkpoint is chosen from here on, without it")
        if not kept:
            return
        paths = list(kept)
        super().load_state_dict(
            {
                "dirpath": self.dirpath,
                "best_k_models": kept,
                "best_model_path": paths[0],
                "best_model_score": kept[paths[0]],
                "kth_best_model_path": paths[-1],
                "kth_value": kept[paths[-1]],
            }
        )

    def _own_file(self, folder: Path, name: str) -> Path | None:
        """A file in a folder if this callback may have written it there, else None."""
        pattern = re.sub(r"{.*?}", "*", self.filename or "*")
        if not fnmatch(name, f"{pattern}*{self.FILE_EXTENSION}"):
            return None
        with suppress(OSError, ValueError):  # what no file can be called
            file = (folder / name).resolve()
            if file.is_relative_to(folder.resolve()) and file.is_file():
                return file
        return None


def _folder_and_scores(state: Mapping[str, Any], path: Any) -> tuple[str, dict[str, Tensor]]:
    """The folder of the run that a state is of, and the scores of its checkpoints by their paths.

    Raises:
        InputError: The state holds something else.
    """
    folder, scores = state.get("dirpath"), state.get("best_k_models")
    if (
        isinstance(folder, str)
        and isinstance(scores, dict)
        and all(key and isinstance(key, str) and _is_score(scores[key]) for key in scores)
    ):
        return folder, scores
    raise InputError(
        str(path),
        f"the scores of its best checkpoints are {shown(scores)}, in {shown(folder)}",
        "Give a checkpoint that derain wrote.",
    )


def _is_score(value: Any) -> bool:
    if isinstance(value, Tensor):
        return value.ndim == 0 and not value.is_complex() and not bool(torch.isnan(value))
    return type(value) in (int, float) and value == value


def _copied(trainer: lightning.Trainer, found: Path | None, copy: str) -> bool:
    """Copies a checkpoint of an earlier run, in the first process; whether it was there."""
    if trainer.is_global_zero and found is not None:
        with replacing(Path(copy)) as temporary:
            shutil.copyfile(found, temporary)
    return bool(trainer.strategy.broadcast(found is not None))
