"""The best checkpoint of a training run, which a resumed run takes along."""

import os
import re
import shutil
from collections.abc import Mapping
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import lightning
from lightning.pytorch.callbacks import ModelCheckpoint
from torch import Tensor

from derain.errors import InputError
from derain.files.atomic import replacing
from derain.files.documents import shown
from derain.models.former_names import current_monitor
from derain.system.notices import warn


class BestCheckpoint(ModelCheckpoint):
    """Keeps the best epochs; a resumed run goes on with the best one before, in whichever folder.

    Lightning forgets what was best when the folder changes, and calls the first epoch there the
    best, however poor. This one goes on with the score and with a copy of the file; that of the
    earlier run stays.

    Lightning removes a file that it has kept once there is a better one, and a checkpoint is not
    trusted to name it. So it is looked for beside the checkpoint, or in the run's own folder where
    it wrote there before, and only under names that this callback gives.
    """

    _earlier: Mapping[str, Any] | None = None  # state of the run that this one goes on from

    def setup(self, trainer: lightning.Trainer, pl_module: Any, stage: str) -> None:
        """Takes the monitor's current name for the one in a configuration of an earlier version.

        Where several epochs are kept, their names have their numbers.

        A training of fewer epochs than there are between two validations ends with one: without,
        nothing of it would be kept.
        """
        if self.monitor is not None:
            self.monitor = current_monitor(self.monitor)
        if self.save_top_k not in (0, 1) and self.filename and "{" not in self.filename:
            self.filename += "-{epoch}"  # each would overwrite the one before, however good
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
            InputError: A state of no checkpoint and score, or a copy that cannot be written.
        """
        super().on_train_start(trainer, pl_module)
        if self._earlier is not None and not trainer.fast_dev_run:  # type: ignore[attr-defined]
            self._go_on_from(trainer, self._earlier)
        self._earlier = None

    def _go_on_from(self, trainer: lightning.Trainer, earlier: Mapping[str, Any]) -> None:
        path, score = earlier.get("best_model_path"), earlier.get("best_model_score")
        if score is None:
            return  # there was none yet
        if not (path and isinstance(path, str) and _is_score(score)):
            raise InputError(
                str(trainer.ckpt_path),
                f"its best checkpoint is {shown(path)}, of the score {shown(score)}",
                "Give a checkpoint that derain wrote.",
            )
        wrote_here, beside = earlier.get("dirpath") == self.dirpath, Path(trainer.ckpt_path or "")
        found = (Path(str(self.dirpath)) if wrote_here else beside.parent) / Path(path).name
        copy = os.path.join(str(self.dirpath), found.name)
        pattern = re.sub(r"{.*?}", "*", self.filename or "*") + f"*{self.FILE_EXTENSION}"
        is_there = fnmatch(found.name, pattern) and os.path.isfile(found)
        if not trainer.strategy.broadcast(is_there):
            if trainer.is_global_zero:
                warn(f"{path}: not found; the best checkpoint is chosen from here on, without it")
            return
        if trainer.is_global_zero and found != Path(copy):
            with replacing(Path(copy)) as temporary:
                shutil.copyfile(found, temporary)
        self.best_k_models = {copy: score}
        self.best_model_path = self.kth_best_model_path = copy
        self.best_model_score = self.kth_value = score


def _is_score(value: Any) -> bool:
    if not isinstance(value, Tensor) or value.ndim > 0 or value.is_complex():
        return False
    return not bool(value.isnan())
