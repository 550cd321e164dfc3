"""Training learns, goes on where it stopped, and does the same again from the same seed."""

from pathlib import Path
from typing import Any

import lightning
import numpy as np
import pytest
import torch
from lightning.pytorch.callbacks import ModelCheckpoint

from derain.datamodules.augmentation import Augmentation
from derain.files.labels import write_labels
from derain.learning.batch import Batch
from derain.learning.losses import class_weights
from derain.models.checkpoint import load_model
from derain.models.lisnownet import LiSnowNet
from derain.models.measured import MONITOR
from derain.models.outdet import OutDet
from derain.models.salsanext import SalsaNext
from derain.scan import Bools, Float32s
from derain.sources.training_record import record_of_scans

from .conftest import assert_same
from .two_processes import GRID

RAIN = 3


def iou(predicted: Bools, rain: Bools) -> float:
    return np.count_nonzero(predicted & rain) / np.count_nonzero(predicted | rain)


@pytest.mark.parametrize("called", [False, True], ids=["nothing is called rain", "all is"])
def test_without_rain_to_validate_on_the_best_epoch_is_that_of_the_least_loss(
    make_trainer, scenes, tmp_path, capsys, called
) -> None:
    data = scenes()
    write_labels(tmp_path / "3.label", np.zeros(300, int))

    class Loud(OutDet):
        def probabilities(self, *arguments: Any) -> list[Float32s]:
            return [np.full_like(each, called) for each in super().probabilities(*arguments)]

    trainer = make_trainer(epochs=2, num_sanity_val_steps=1)
    trainer.fit(Loud(), data)
    scores = trainer.callback_metrics
    assert scores["val/iou"].isnan() != called
    assert scores[MONITOR] == -scores["val/loss"]
    assert capsys.readouterr().err.count("no point of these scans") == 1


# Small networks of every kind; each draws dropout.
@pytest.mark.parametrize(
    ("network", "options", "workers"),
    [
        (OutDet, {"milestones": (1, 3)}, 2),
        (SalsaNext, {"grid": GRID, "width": 2, "warm_up": 1.5}, 0),
        (LiSnowNet, {"grid": GRID, "width": 2}, 0),
    ],
)
def test_a_run_goes_on_from_its_last_checkpoint_as_if_it_had_not_stopped(
    make_trainer, scenes, tmp_path, network, options, workers
) -> None:
    # All that training draws: order, every augmentation, dropout.
    changed = Augmentation(mirror_probability=0.5, dropping_probability=0.5)

    def fit(epochs: int, checkpoint: Path | None = None) -> lightning.Trainer:
        lightning.seed_everything(0)
        model = network(**options)
        torch.rand(epochs)  # what else draws is not to matter
        last = ModelCheckpoint(tmp_path, filename=f"last{epochs}", enable_version_counter=False)
        trainer = make_trainer(epochs=epochs, callbacks=[last], enable_checkpointing=True)
        data = scenes(augmentation=changed, batch_size=2, workers=workers)
        trainer.fit(model, data, ckpt_path=checkpoint)
        return trainer

    straight, stopped = fit(epochs=4), fit(epochs=2)
    resumed = fit(epochs=4, checkpoint=tmp_path / "last2.ckpt")
    assert resumed.global_step == straight.global_step == 8
    weights = [run.lightning_module.state_dict() for run in (straight, resumed, stopped)]
    assert_same(weights[1], weights[0])
    assert any(not torch.equal(weights[2][name], weights[0][name]) for name in weights[0])
    schedules = [run.optimizers[0].param_groups[0]["lr"] for run in (straight, resumed)]
    assert schedules[0] == schedules[1]
    assert_same(resumed.callback_metrics, straight.callback_metrics)


def test_a_run_that_stopped_in_the_middle_of_an_epoch_does_not_start_from_the_first(
    make_trainer, scenes, tmp_path
) -> None:
    class Seen(lightning.Callback):
        def __init__(self) -> None:
            self.points: list[list[float]] = []

        def on_train_batch_start(self, trainer: Any, module: Any, batch: Batch, *_: Any) -> None:
            self.points.append(batch.inputs["points"].sum(dim=0).tolist())

    def fit(steps: int, checkpoint: Path | None = None) -> list[list[float]]:
        lightning.seed_everything(0)
        seen = Seen()
        trainer = make_trainer(epochs=-1, max_steps=steps, callbacks=[seen])
        trainer.fit(OutDet(), scenes(), ckpt_path=checkpoint)
        trainer.save_checkpoint(tmp_path / "middle.ckpt")
        return seen.points

    first = fit(steps=4)  # of three an epoch
    onward = fit(steps=9, checkpoint=tmp_path / "middle.ckpt")
    assert len(onward) == 5
    assert not [points for points in onward if points in first[:3]]


def test_a_checkpoint_of_a_run_is_a_model_and_has_the_normalisation_of_a_test(
    make_trainer, scenes, tmp_path
) -> None:
    model = OutDet(neighbours=6)
    trainer = make_trainer(epochs=1)
    trainer.fit(model, scenes())
    assert trainer.callback_metrics[MONITOR] == trainer.callback_metrics["val/iou"]
    trainer.save_checkpoint(tmp_path / "run.ckpt")
    copy = load_model(tmp_path / "run.ckpt")
    assert copy.spec == model.spec
    assert copy.spec.view == {"kind": "neighbours", "neighbours": 6}
    assert copy.spec.training == record_of_scans(scenes().frames("train"))
    assert_same(copy.state_dict(), model.state_dict())
    other = OutDet(neighbours=6)
    make_trainer(epochs=1).test(other, scenes(), ckpt_path=tmp_path / "run.ckpt", verbose=False)
    assert other.spec == model.spec
    assert torch.equal(other.mean, model.mean)
    assert torch.equal(other.std, model.std)


def test_a_network_of_candidates_learns_from_them_and_judges_them_alone(
    make_trainer, scenes, tmp_path
) -> None:
    data, trainer = scenes(batch_size=2), make_trainer(epochs=2)
    model = OutDet(candidates=0.9)
    trainer.fit(model, data)
    candidates = model.spec.candidates
    assert {bound.channel for bound in candidates.bounds} <= {"range", "z", "intensity"}
    shares = [1 - candidates.rain_share, candidates.rain_share]
    assert torch.equal(model.class_weight, class_weights(shares))
    (batch,) = data.val_dataloader()
    scan = data.reader.read(data.frames("validation")[0])
    among = candidates.among(scan)
    assert 0 < batch.cells[0] == among.sum() < 300
    assert batch.target.sum() == (scan.label[among] == RAIN).sum()
    (probability,) = trainer.predict(model, data)[0]
    assert (probability[among] > 0).all()
    assert (probability[~among] == 0).all()
    (scores,) = trainer.test(model, data, verbose=False)
    rain = scan.label == RAIN
    assert scores["test/iou"] == pytest.approx(iou(probability > model.spec.threshold, rain))
    trainer.save_checkpoint(tmp_path / "run.ckpt")
    assert load_model(tmp_path / "run.ckpt").spec == model.spec
