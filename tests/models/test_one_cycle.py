"""The learning rate of a network of cues rises and falls once, planned to the last step."""

from pathlib import Path
from types import SimpleNamespace

import lightning
import numpy as np
import pytest
from lightning.pytorch.callbacks import ModelCheckpoint

from derain.datamodules.in_memory import InMemory
from derain.datamodules.scan_data import Loading
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.models.cues import CueFusion
from derain.models.cues.module import FIRST_DIVISOR
from derain.scan import Scan


def labelled(seed: int) -> Scan:
    """A scene with drops in the air: WADS's falling snow."""
    generator = np.random.default_rng(seed)
    flying = np.concatenate([generator.uniform(-8, 8, (300, 3)), np.zeros((300, 1))], axis=1)
    points = np.concatenate([scene(3000), flying])
    return Scan.of(points).with_label(np.repeat([40, 110], [3000, 300]))


def test_a_learning_rate_of_one_cycle_needs_a_last_step() -> None:
    model = CueFusion()
    model.trainer = SimpleNamespace(estimated_stepping_batches=float("inf"))
    with pytest.raises(InputError, match="max_epochs"):
        model.configure_optimizers()


@pytest.mark.parametrize("steps", [1, 2, 9, 10, 11, 40])
def test_a_learning_rate_of_one_cycle_begins_low_however_short_the_training(steps) -> None:
    model = CueFusion()
    model.trainer = SimpleNamespace(estimated_stepping_batches=steps)
    schedule = model.configure_optimizers()["lr_scheduler"]["scheduler"]
    rates = [schedule.get_last_lr()[0]]
    for _ in range(steps - 1):
        schedule.optimizer.step()
        schedule.step()
        rates += schedule.get_last_lr()
    highest = model.hparams["learning_rate"]
    assert rates[0] == pytest.approx(highest / FIRST_DIVISOR)
    assert max(rates) <= highest


def test_a_training_of_one_cycle_goes_on_with_steps_of_as_many_scans_alone(
    make_trainer, tmp_path
) -> None:
    scans = [labelled(seed) for seed in range(2)]

    def fit(batch_size: int, checkpoint: Path | None = None) -> lightning.Trainer:
        every = ModelCheckpoint(tmp_path, filename="{epoch}", save_top_k=-1)
        trainer = make_trainer(2, callbacks=[every], enable_checkpointing=True)
        data = InMemory(scans, scans, card="wads", loading=Loading(batch_size=batch_size))
        trainer.fit(CueFusion(), data, ckpt_path=checkpoint)
        return trainer

    assert fit(batch_size=2).global_step == 2
    first = tmp_path / "epoch=0.ckpt"
    assert fit(batch_size=2, checkpoint=first).global_step == 2
    with pytest.raises(InputError, match="learning rate for 2 steps, where this run takes 4"):
        fit(batch_size=1, checkpoint=first)
