"""Checkpoints and configurations of earlier versions, which have former names."""

from pathlib import Path

import lightning
import torch

from derain.models.callbacks.best_checkpoint import BestCheckpoint
from derain.models.measured import MONITOR
from derain.models.published import read_checkpoint


def test_a_checkpoint_of_an_earlier_version_is_read_with_current_names(tmp_path: Path) -> None:
    spec = {"view": {"way_back": "vote"}}  # the key of a Spec stays
    earlier = {
        "hyper_parameters": {"grid": "wads", "way_back": "vote", "spec": spec},
        "callbacks": {"ModelCheckpoint{'monitor': 'val/merit'}": {}, "StepTimes": {}},
        "state_dict": {},
    }
    torch.save(earlier, tmp_path / "earlier.ckpt")
    assert read_checkpoint(tmp_path / "earlier.ckpt") == {
        "hyper_parameters": {"grid": "wads", "back_projection": "vote", "spec": spec},
        "callbacks": {f"ModelCheckpoint{{'monitor': '{MONITOR}'}}": {}, "StepTimes": {}},
        "state_dict": {},
    }


def test_a_monitor_of_an_earlier_configuration_is_followed(tmp_path: Path) -> None:
    callback = BestCheckpoint(tmp_path, monitor="val/merit", mode="max")
    trainer = lightning.Trainer(accelerator="cpu", logger=False, enable_checkpointing=False)
    callback.setup(trainer, lightning.LightningModule(), "fit")
    assert callback.monitor == MONITOR
    assert repr(MONITOR) in callback.state_key
