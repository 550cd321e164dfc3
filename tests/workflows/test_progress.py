"""After each epoch a line has how far the training is, how good, and how long it still takes."""

import math
import time
from types import SimpleNamespace

import pytest

from derain.workflows.progress import EpochLines


@pytest.fixture
def seconds(monkeypatch) -> list[float]:
    """What the clock reads, from its first reading on."""
    readings: list[float] = []
    monkeypatch.setattr(time, "monotonic", lambda: readings.pop(0))
    return readings


def trainer(epoch: int, last: int | None, iou: float | None = None, first_process: bool = True):
    metrics = {} if iou is None else {"val_iou": iou}
    return SimpleNamespace(
        current_epoch=epoch, max_epochs=last, callback_metrics=metrics, is_global_zero=first_process
    )


@pytest.mark.parametrize(
    ("epoch", "last", "iou", "line"),
    [
        (2, 20, 0.8124, "epoch 3 of 20: IoU 0.812; 1:12, 6:48 left"),
        (19, 20, math.nan, "epoch 20 of 20: 1:12, 0:00 left"),
        (0, -1, None, "epoch 1: 1:12"),
        (0, None, 1.0, "epoch 1: IoU 1.000; 1:12"),
    ],
)
def test_a_line_counts_epochs_and_time(seconds, epoch, last, iou, line, capsys) -> None:
    seconds += [100.0, 172.0]
    lines = EpochLines()
    lines.on_train_start(trainer(0, last), None)
    lines.on_train_epoch_end(trainer(epoch, last, iou), None)
    assert capsys.readouterr() == ("", f"{line}\n")


def test_a_training_that_goes_on_reckons_by_its_own_epochs(seconds, capsys) -> None:
    seconds += [0.0, 60.0, 60.0]
    lines = EpochLines()
    lines.on_train_start(trainer(10, 14), None)
    lines.on_train_epoch_end(trainer(10, 14), None)
    assert capsys.readouterr().err == "epoch 11 of 14: 1:00, 3:00 left\n"
    lines.on_train_epoch_end(trainer(10, 14, first_process=False), None)
    assert capsys.readouterr().err == ""
