"""A training whose loss is no number stops, and the checkpoints before that stay."""

import math

import lightning
import pytest
import torch
from lightning.pytorch.callbacks import ModelCheckpoint
from torch import Tensor

from derain.errors import InputError
from derain.models.callbacks.finite_loss import FiniteLoss


class Failing(lightning.LightningModule):
    """Its loss is not finite from a step on."""

    def __init__(self, last_good: int, loss: float) -> None:
        super().__init__()
        self.weight = torch.nn.Parameter(torch.ones(1))
        self.last_good, self.loss = last_good, loss

    def training_step(self, batch: Tensor) -> Tensor:
        return (self.weight * (1.0 if self.global_step < self.last_good else self.loss)).sum()

    def configure_optimizers(self) -> torch.optim.Optimizer:
        return torch.optim.SGD(self.parameters(), lr=0.1)


@pytest.mark.parametrize("loss", [math.nan, math.inf])
@pytest.mark.parametrize(
    ("every", "stops_at"), [(1, 5), (3, 6), (100, 8)], ids=["each step", "some steps", "epochs"]
)
def test_it_stops_when_it_looks_next(make_trainer, tmp_path, loss, every, stops_at) -> None:
    last = ModelCheckpoint(tmp_path, filename="last")
    trainer = make_trainer(
        9, callbacks=[FiniteLoss(), last], enable_checkpointing=True, log_every_n_steps=every
    )
    data = torch.utils.data.DataLoader(torch.ones(4))
    with pytest.raises(InputError, match=f"not finite after {stops_at} steps"):
        trainer.fit(Failing(4, loss), data)
    kept = torch.load(tmp_path / "last.ckpt", weights_only=True)
    assert kept["global_step"] == 4
    assert kept["state_dict"]["weight"].isfinite()
