"""What a step's time is spent on, by a clock that the test moves."""

import time
from types import SimpleNamespace
from typing import Any

import pytest
import torch

from derain.learning.batch import Batch
from derain.models.callbacks.step_times import StepTimes

PROCESSES = 3
MODEL: Any = SimpleNamespace(device=torch.device("cpu"))


class Training:
    """A training of steps that take the given times, logged every few steps."""

    def __init__(self) -> None:
        self.now = 100.0
        self.logged: list[tuple[int, dict[str, float]]] = []
        logger = SimpleNamespace(
            log_metrics=lambda values, step: self.logged.append((step, values))
        )
        self.trainer: Any = SimpleNamespace(
            log_every_n_steps=2, world_size=PROCESSES, loggers=[logger], global_step=0
        )
        self.times = StepTimes()

    def step(self, wait: float, network: float, scans: int = 1, **made: float) -> None:
        self.now += wait
        batch = Batch({}, None, [10] * scans, [], made)
        self.times.on_train_batch_start(self.trainer, MODEL, batch, 0)
        self.now += network
        self.trainer.global_step += 1
        self.times.on_train_batch_end(self.trainer, MODEL, None, batch, 0)


@pytest.fixture
def training(monkeypatch) -> Training:
    made = Training()
    monkeypatch.setattr(time, "perf_counter", lambda: made.now)
    made.times.on_train_start()
    made.times.on_train_epoch_start()
    return made


def spent(read: float, view: float, wait: float, network: float, speed: float) -> Any:
    group = "milliseconds_per_step/"
    means = {"read": read, "view": view, "wait": wait, "network": network}
    values = {group + name: value for name, value in means.items()}
    return pytest.approx({**values, "speed/scans_per_second": PROCESSES * speed})


def test_means_are_logged_as_often_as_the_trainer_logs(training) -> None:
    training.step(50, 60)  # the first one starts the workers
    training.step(0.1, 0.4, scans=2, read=30, view=50)
    assert not training.logged
    training.step(0.3, 0.2, scans=1, read=10, view=20)
    training.step(0.0, 0.5, scans=4)  # of scans that were kept
    training.times.on_train_end(training.trainer, MODEL)
    assert training.logged == [
        (3, spent(read=20, view=35, wait=200, network=300, speed=3 / 1.0)),
        (4, spent(read=0, view=0, wait=0, network=500, speed=4 / 0.5)),
    ]


def test_neither_validation_nor_what_lies_between_epochs_is_waited_for(training) -> None:
    training.step(0, 1)
    training.times.on_validation_start()
    training.now += 1000
    training.step(7, 1)  # how long it was waited for is not known
    training.now += 1000
    training.times.on_train_epoch_start()
    training.step(1, 1)
    assert training.logged == [(3, spent(read=0, view=0, wait=500, network=1000, speed=2 / 3))]


def test_a_training_that_logs_no_steps_prints_its_times_at_its_end(training) -> None:
    training.trainer.log_every_n_steps = 0
    for _ in range(5):
        training.step(0, 1)
    assert not training.logged
    training.times.on_train_end(training.trainer, MODEL)
    assert training.logged == [(5, spent(read=0, view=0, wait=0, network=1000, speed=1))]


def test_a_graphics_card_is_waited_for_at_one_step_of_those_that_are_logged(
    training, monkeypatch
) -> None:
    waits = []

    def synchronise(device: torch.device) -> None:
        waits.append(training.trainer.global_step)
        training.now += 3

    monkeypatch.setattr(torch.cuda, "synchronize", synchronise)
    monkeypatch.setattr(MODEL, "device", torch.device("cuda", 0))
    for _ in range(5):
        training.step(0, 1)
    assert waits == [2, 3, 4, 5]  # before and after the third step and the fifth
    network = [values["milliseconds_per_step/network"] for _, values in training.logged]
    assert network == pytest.approx([4000, 4000])
    speed = [values["speed/scans_per_second"] for _, values in training.logged]
    assert speed == pytest.approx([PROCESSES * 2 / 8] * 2)
