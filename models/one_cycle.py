"""AdamW with a learning rate that rises and falls once in the whole training."""

import torch
from lightning.pytorch.utilities.types import OptimizerLRScheduler

from derain.models.base import DerainingModule

# Share of the training in which the learning rate rises; then it falls.
WARM_UP_SHARE = 0.1

# The first learning rate is the highest divided by this, and the last at least this share of it.
FIRST_DIVISOR, LEAST_SHARE = 25.0, 4e-6


def one_cycle(model: DerainingModule, final_share: float = 0.0) -> OptimizerLRScheduler:
    """The optimiser of a model, by its highest ``learning_rate`` and its ``weight_decay``.

    Args:
        model: The model.
        final_share: How much of the highest learning rate is left at the end.

    Source: L. N. Smith and N. Topin, "Super-Convergence: Very Fast Training of Neural Networks
        Using Large Learning Rates", 2018.
    """
    rate = model.hparams["learning_rate"]
    optimizer = torch.optim.AdamW(
        model.parameters(), lr=rate, weight_decay=model.hparams["weight_decay"]
    )
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimizer,
        rate,
        total_steps=max(int(model.trainer.estimated_stepping_batches), 2),
        pct_start=WARM_UP_SHARE,
        div_factor=FIRST_DIVISOR,
        final_div_factor=1 / (FIRST_DIVISOR * max(final_share, LEAST_SHARE)),
    )
    return {"optimizer": optimizer, "lr_scheduler": {"scheduler": schedule, "interval": "step"}}
