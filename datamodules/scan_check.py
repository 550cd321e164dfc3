"""Warns of scans that do not suit the model."""

from dataclasses import replace
from typing import Any

import lightning
from lightning.pytorch.trainer.states import TrainerFn

from derain.datamodules.base import Part, ScanDataModule
from derain.sources.spread import evenly_spaced
from derain.sources.training_record import training_overlap
from derain.system.notices import Notices, warn


class ScanCheck(lightning.Callback):
    """Warns of scans without a channel of the model, of another unit, or that it was trained on.

    It checks before the first batch: hours of training on a wrong unit would be lost.

    Args:
        scans: Number of scans of a part to check, spread evenly.
    """

    def __init__(self, scans: int = 10) -> None:
        self.scans = scans

    def on_fit_start(self, trainer: lightning.Trainer, model: Any) -> None:
        """Checks training scans."""
        self._check(trainer, model, "train")

    def on_validation_start(self, trainer: lightning.Trainer, model: Any) -> None:
        """Checks validation scans, unless they belong to a training."""
        if trainer.state.fn == TrainerFn.VALIDATING:
            self._check(trainer, model, "validation")

    def on_test_start(self, trainer: lightning.Trainer, model: Any) -> None:
        """Checks test scans."""
        self._check(trainer, model, "test")

    def on_predict_start(self, trainer: lightning.Trainer, model: Any) -> None:
        """Checks the scans to predict."""
        self._check(trainer, model, "predict")

    def _check(self, trainer: lightning.Trainer, model: Any, part: Part) -> None:
        if not trainer.is_global_zero:
            return
        data = trainer.datamodule  # type: ignore[attr-defined]
        if not isinstance(data, ScanDataModule):  # a user's own loaders are not checked
            return
        frames, notices = data.frames(part), Notices()
        for frame in evenly_spaced(frames, self.scans):
            found = model.spec.issues(data.reader.read(frame))
            notices.warn(frame.name, [replace(o, detail=_here(o.detail)) for o in found])
        notices.warn_of_repeats()
        if part in ("validation", "test"):
            note = training_overlap("the model", model.spec, model.card, frames)
            if note is not None:
                warn(note)


def _here(detail: str) -> str:
    """The same, with the name that the option has in training."""
    return detail.replace("--intensity-scale", "--data.loading.intensity_scale")
