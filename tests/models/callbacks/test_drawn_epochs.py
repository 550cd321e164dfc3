"""Which epochs are drawn: so many of a training, and few of one without an end."""

from collections.abc import Callable

import lightning
import pytest
from lightning.pytorch.trainer.states import TrainerFn

from derain.models.callbacks.panels import DrawnEpochs

MakeTrainer = Callable[..., lightning.Trainer]


def drawn_of(
    trainer: lightning.Trainer, chosen: DrawnEpochs, last: int, step: int, validations: int = 1
) -> list[int]:
    trainer.state.fn = TrainerFn.FITTING
    drawn = []
    for epoch in range(step - 1, last, step):
        trainer.fit_loop.epoch_progress.current.completed = epoch
        drawn += [epoch for _ in range(validations) if chosen.begins(trainer)]
    return drawn


@pytest.mark.parametrize(
    ("epochs", "every", "pictures", "drawn"),
    [
        (3, 1, 10, [0, 1, 2]),
        (60, 1, 4, [0, 20, 39, 59]),
        (60, 10, 10, [9, 19, 29, 39, 49, 59]),
        (60, 10, 2, [9, 59]),
        (60, None, 2, [0, 59]),
        (5, 1, 1, [0]),
        (5, 1, 0, []),
        (-1, 1, 2, [0, 1, 3, 7, 15, 31, 63]),
        (-1, 10, 2, [9, 19, 39]),
    ],
    ids=str,
)
def test_the_epochs_that_are_drawn_are_spread_over_the_training(
    make_trainer: MakeTrainer, epochs: int, every: int | None, pictures: int, drawn: list[int]
) -> None:
    trainer = make_trainer(epochs)
    trainer.check_val_every_n_epoch = every
    last = epochs if epochs > 0 else 70
    assert drawn_of(trainer, DrawnEpochs(pictures), last, every or 1) == drawn


def test_of_several_validations_in_an_epoch_one_is_drawn(make_trainer: MakeTrainer) -> None:
    assert drawn_of(make_trainer(3), DrawnEpochs(10), 3, 1, validations=50) == [0, 1, 2]


def test_a_test_is_drawn_and_a_sanity_check_is_not(make_trainer: MakeTrainer) -> None:
    trainer = make_trainer(3)
    trainer.state.fn = TrainerFn.TESTING
    assert DrawnEpochs(1).begins(trainer)
    assert not DrawnEpochs(0).begins(trainer)
    trainer.sanity_checking = True
    assert not DrawnEpochs(1).begins(trainer)
