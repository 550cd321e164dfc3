"""The best checkpoint of a training run, which a run that goes on takes along."""

import os
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import lightning
from lightning.pytorch.callbacks import ModelCheckpoint
from torch import Tensor

from derain.files.atomic import replacing
from derain.system.notices import warn


class BestCheckpoint(ModelCheckpoint):
    """Keeps the best epochs, also of a run that goes on in a folder of its own.

    Lightning forgets what was best when the folder changes, and calls the first epoch there the
    best, however poor. This one goes on with the scores and with copies of the files; those of the
    earlier run stay.
    """

    _earlier: Mapping[str, Any] | None = None  # state of a run that wrote to another folder

    @property
    def state_key(self) -> str:
        """Where checkpoints keep the state: as Lightning's, for a run may go on from its own."""
        return super().state_key.replace(type(self).__qualname__, ModelCheckpoint.__qualname__, 1)

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Takes over the state; that of another folder when the training starts, if it does."""
        if state_dict.get("dirpath", self.dirpath) == self.dirpath:
            super().load_state_dict(state_dict)
        else:
            self._earlier = state_dict

    def on_train_start(self, trainer: lightning.Trainer, pl_module: Any) -> None:
        """Goes on with what was best in another folder.

        Raises:
            InputError: A copy cannot be written.
        """
        super().on_train_start(trainer, pl_module)
        if self._earlier is not None and not trainer.fast_dev_run:  # type: ignore[attr-defined]
            self._go_on_from(trainer, self._earlier)
        self._earlier = None

    def _go_on_from(self, trainer: lightning.Trainer, earlier: Mapping[str, Any]) -> None:
        found = earlier.get("best_k_models", {})
        ranking = sorted(found, key=lambda path: float(found[path]), reverse=self.mode == "max")
        scores: dict[str, Tensor] = {}  # the best first
        for path in ranking[: None if self.save_top_k < 0 else self.save_top_k]:
            copy = os.path.join(str(self.dirpath), os.path.basename(path))
            if _copied(trainer, path, copy):
                scores[copy] = found[path]
            elif trainer.is_global_zero:
                warn(f"{path}: not found; the best checkpoint is chosen from here on, without it")
        if not scores:
            return
        paths = list(scores)
        super().load_state_dict(
            {
                "dirpath": self.dirpath,
                "best_k_models": scores,
                "best_model_path": paths[0],
                "best_model_score": scores[paths[0]],
                "kth_best_model_path": paths[-1],
                "kth_value": scores[paths[-1]],
            }
        )


def _copied(trainer: lightning.Trainer, path: str, copy: str) -> bool:
    """Copies a checkpoint of an earlier run, in the first process; whether it was there."""
    found = None
    if trainer.is_global_zero and "://" not in copy:
        # A folder that was moved, or named from another one, is where the run goes on from.
        beside = Path(trainer.ckpt_path or path).parent / os.path.basename(path)
        found = next((file for file in (beside, Path(path)) if file.is_file()), None)
    if found is not None:
        with replacing(Path(copy)) as temporary:
            shutil.copyfile(found, temporary)
    return bool(trainer.strategy.broadcast(found is not None))
